// SPDX-License-Identifier: BSD-3-Clause
#include "page.h"

#include <map>
#include <string_view>

#include "embedded.h"

namespace fcl_fibers::tools {
namespace {

/// Replaces each @name@ whose name is a key. Inserted text is not searched.
std::string filled(std::string_view text,
                   const std::map<std::string_view, std::string_view>& values) {
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

std::string makePage(const std::string& title, const std::string& data, bool fragment,
                     bool has_guide) {
  std::string escaped_title = title;
  replaceAll(escaped_title, "&", "&amp;");
  replaceAll(escaped_title, "<", "&lt;");
  std::string escaped_data = data;
  // Otherwise a name could end the script element.
  replaceAll(escaped_data, "<", "\\u003c");
  auto values = embeddedFiles;
  values["embedded"] = fragment ? "true" : "false";
  values["data"] = escaped_data;
  if (!has_guide) values["guide.js"] = "";
  const std::string viewer = filled(values.at("viewer.html"), values);
  if (fragment) return viewer;
  return filled(values.at("page.html"), {{"title", escaped_title}, {"viewer", viewer}});
}

}  // namespace fcl_fibers::tools
