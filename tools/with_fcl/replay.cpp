// SPDX-License-Identifier: BSD-3-Clause
#include "replay.h"

#include <cstddef>
#include <string>

#include <fcl_fibers/shadow_manager.h>
#include <fmt/format.h>

#include "tools/commands.h"

namespace fcl_fibers::tools {

int replay(const std::string& path) {
  const ShadowReplay replay = replayRecord(path);
  const ShadowResult& result = replay.result;
  const auto told = [](const std::string& difference) {
    std::string lines = difference.empty() ? "none" : difference;
    for (std::size_t at = 0; (at = lines.find("; ", at)) != std::string::npos;) {
      lines.replace(at, 2, "\n          ");
    }
    return lines;
  };
  print(
      fmt::format("managers  {}\ncalls     {} and {}\npairs     {} of the first, {} of the second\n"
                  "recorded  {}\nfound     {}\n",
                  readable(replay.managers), counted(result.changes, "change"),
                  result.queries == 1 ? "1 query" : countText(result.queries) + " queries",
                  countText(result.first.pairs), countText(result.second.pairs),
                  told(readable(replay.recorded)), told(readable(result.difference))));
  return result.differences > 0 ? kExitContacts : 0;
}

}  // namespace fcl_fibers::tools
