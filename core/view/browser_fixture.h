// Runs a page in headless Chromium, driven by a script of Node. For tests of this folder.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/process/subprocess.h"
#include "core/view/view_page.h"

namespace color3d {

// Skips where the viewer, Chromium or Node is missing.
class BrowserFixture : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!HasViewer()) GTEST_SKIP() << "skipped, because the viewer was left out of this build";
    chromium_ = FirstOf({"chromium", "chromium-browser", "google-chrome"});
    if (chromium_.empty()) GTEST_SKIP() << "skipped, because there is no Chromium";
    if (FirstOf({"node"}).empty()) GTEST_SKIP() << "skipped, because there is no Node";
  }

  // Runs `node script CHROMIUM page arguments...`; returns the JSON that it prints.
  nlohmann::json RunInBrowser(const std::string& script,
                              const std::string& page,
                              const std::vector<std::string>& arguments,
                              const std::vector<std::string>& environment = {}) {
    const std::string log = scratch_.path() / ("log" + std::to_string(++runs_));
    std::vector<std::string> command = {"node", script, chromium_, page};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const SubprocessResult result = RunSubprocess({.arguments = command,
                                                   .environment = environment,
                                                   .log_path = log,
                                                   .timeout = std::chrono::seconds(150)},
                                                  CancellationToken());
    const std::string text = ReadFile(log);
    EXPECT_EQ(result.exit_code, 0) << text;
    return nlohmann::json::parse(text);
  }

  ScratchFolder scratch_;

 private:
  static std::string FirstOf(const std::vector<std::string>& programs) {
    for (const std::string& program : programs) {
      try {
        if (RunSubprocess({.arguments = {program, "--version"}}, CancellationToken()).exit_code ==
            0) {
          return program;
        }
      } catch (const Error&) {  // not installed
      }
    }
    return "";
  }

  std::string chromium_;
  int runs_ = 0;
};

}  // namespace color3d
