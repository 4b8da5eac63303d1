// SPDX-License-Identifier: BSD-3-Clause
#include "page.h"

#include <map>
#include <string_view>

#include "embedded.h"

namespace fcl_fibers::tools {
namespace {

/// Replaces each @name@ whose name is a key. Inserted text is not searched.
std::string filled(std::string_view text, const std::map<std::string_view, std::string>& values) {
  std::string result;
  std::size_t done = 0;
  for (std::size_t at = text.find('@'); at != std::string_view::npos; at = text.find('@', at + 1)) {
    const std::size_t end = text.find('@', at + 1);
    if (end == std::string_view::npos) break;
    const auto value = values.find(text.substr(at + 1, end - at - 1));
    if (value == values.end()) continue;
    result.append(text.substr(done, at - done)).append(value->second);
    at = end;
    done = end + 1;
  }
  return result.append(text.substr(done));
}

void replaceAll(std::string& text, std::string_view what, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size()) {
    text.replace(at, what.size(), by);
  }
}

}  // namespace

std::string makePage(const std::string& title, const std::string& data, bool fragment) {
  std::string escaped_title = title;
  replaceAll(escaped_title, "&", "&amp;");
  replaceAll(escaped_title, "<", "&lt;");
  std::string escaped_data = data;
  // Otherwise a name could end the script element.
  replaceAll(escaped_data, "<", "\\u003c");
  const auto text = [](std::string_view file) { return std::string(file); };
  const std::string viewer =
      filled(embedded::viewer_html, {{"viewer.css", text(embedded::viewer_css)},
                                     {"viewer.js", text(embedded::viewer_js)},
                                     {"three.min.js", text(embedded::three_min_js)},
                                     {"OrbitControls.js", text(embedded::OrbitControls_js)},
                                     {"embedded", fragment ? "true" : "false"},
                                     {"data", escaped_data}});
  if (fragment) return viewer;
  return filled(embedded::page_html, {{"title", escaped_title}, {"viewer", viewer}});
}

}  // namespace fcl_fibers::tools
