// SPDX-License-Identifier: BSD-3-Clause
#include "replay.h"

#include <string>

#include <fcl_fibers/shadow_manager.h>
#include <fmt/format.h>

#include "tools/commands.h"

namespace fcl_fibers::tools {

int replay(const std::string& path) {
  const auto [result, recorded, managers] = replayRecord(path);
  const auto told = [](const std::string& text) { return text.empty() ? "none" : readable(text); };
  print(fmt::format(
      "managers  {}\ncalls     {} changes and {} queries\npairs     {} of the first, {} of the "
      "second\nrecorded  {}\nfound     {}\n",
      readable(managers), countText(result.changes), countText(result.queries),
      countText(result.first.pairs), countText(result.second.pairs), told(recorded),
      told(result.difference)));
  return result.differences > 0 ? kExitContacts : 0;
}

}  // namespace fcl_fibers::tools
