// `color3d studio` against a server of its own, with Chromium driven by Node. Skips where they are
// missing.
#pragma once

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/files.h"
#include "tests/integration/service_fixture.h"

namespace color3d {

inline bool IsInstalled(const std::string& program, const ScratchFolder& scratch) {
  return RunProcess({"env", program, "--version"}, scratch.path() / "log", std::chrono::seconds(30))
             .exit_code == 0;
}

class StudioTest : public ServiceTest {
 protected:
  void SetUp() override {
    if (!IsInstalled("chromium", folder_)) GTEST_SKIP() << "skipped, because there is no Chromium";
    if (!IsInstalled("node", folder_)) GTEST_SKIP() << "skipped, because there is no Node";
    ::setenv("XDG_DATA_HOME", Path("home").c_str(), 1);
    StartServer();
  }
  // Returns the address that the studio prints.
  std::string AddressOf(Process& studio) {
    EXPECT_TRUE(WaitUntil([&] { return studio.Out().find('\n') != std::string::npos; },
                          std::chrono::seconds(30)))
        << studio.Err();
    const std::string out = studio.Out();
    return out.substr(0, out.find('\n'));
  }
  // Runs a script of client/studio with Chromium, and returns what it saw.
  nlohmann::json Use(const std::string& script,
                     std::vector<std::string> arguments,
                     std::chrono::seconds limit = std::chrono::seconds(500)) {
    arguments.insert(arguments.begin(), {"node", script, "chromium"});
    if (const char* screenshots = std::getenv("COLOR3D_SCREENSHOTS")) {
      arguments.emplace_back(screenshots);
    }
    const ProcessResult used = RunProcess(arguments, Path("browser"), limit);
    EXPECT_EQ(used.exit_code, 0) << used.err;
    return nlohmann::json::parse(used.out, nullptr, /*allow_exceptions=*/false);
  }
};

}  // namespace color3d
