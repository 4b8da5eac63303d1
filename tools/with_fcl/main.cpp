// SPDX-License-Identifier: BSD-3-Clause
//
// fcl_fibers: the library as a program, for people who have a file of fibers.
#include <string>

#include <fcl_fibers/shadow_manager.h>
#include <fmt/format.h>

#include "scenes/generated_scenes.h"
#include "tools/commands.h"
#include "tools/program.h"
#include "tools/with_fcl/fcl_settings.h"

namespace fcl_fibers::tools {
namespace {

/// Makes the calls of a ShadowManager's record again, and explains the first difference. Returns 1
/// if there is one.
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

}  // namespace
}  // namespace fcl_fibers::tools

int main(int argc, char** argv) {
  using namespace fcl_fibers;
  tools::ProgramParts parts;
  parts.scenes = scenes::generatedScenes();
  parts.replay = tools::replay;
  parts.peers = tools::fclSettings;
  return tools::runProgram({argv + 1, argv + argc}, parts);
}
