// The report in a real browser: headless Chromium, driven by Node.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/base/process/subprocess.h"
#include "core/image/codec.h"
#include "core/report/report_page.h"

namespace color3d {
namespace {

bool Runs(const std::string& program) {
  try {
    return RunSubprocess({.arguments = {program, "--version"}}, CancellationToken()).exit_code == 0;
  } catch (const Error&) {  // not installed
    return false;
  }
}

// Much that could be too wide for a phone: long names, wide tables, digests, commands.
ReportData WidePage() {
  ReportData data;
  data.title = "Color3D: 3 views in colour";
  data.view_page = "view.html";
  for (int i = 0; i < 3; ++i) {
    const std::string jpeg = EncodeJpeg(Image(96, 64, 3, 0.2f + 0.3f * static_cast<float>(i)));
    data.views.push_back({"a_photo_with_quite_a_long_name_without_any_space_" + std::to_string(i),
                          {{"gray", "photo", "the photo", jpeg, 96, 64},
                           {"render", "coloured scene", "rendered", jpeg, 96, 64}}});
  }
  ReportSection section;
  section.title = "Wide";
  section.tables = {
      {std::vector<std::string>(9, "a column"), {std::vector<std::string>(9, "12345.678")}}};
  section.curves = {{"s", 1.0, 1, "e", 2.0}, {"s", 2.0, 2, "e", 1.0}};
  data.sections = {section};
  data.stages = {{"reconstruct_geometry", 12.0}};
  data.plan = {{"key_view_selection", false, "the key view was given", 1.0, -1.0, ""}};
  data.facts = {{"SHA-256 of model.c3g", std::string(64, 'a')}};
  data.repeat = {"color3d colorize PHOTOS -o OUT --key-view " + std::string(90, 'x')};
  return data;
}

TEST(ReportBrowserTest, FitsPhoneAndDesktop) {
  std::string chromium;
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    if (chromium.empty() && Runs(name)) chromium = name;
  }
  if (chromium.empty()) GTEST_SKIP() << "skipped, because there is no Chromium";
  if (!Runs("node")) GTEST_SKIP() << "skipped, because there is no Node";
  const ScratchFolder scratch;
  const std::string page = scratch.path() / "report.html", log = scratch.path() / "log";
  WriteFileAtomic(page, RenderReport(WidePage()));
  const SubprocessResult result =
      RunSubprocess({.arguments = {"node", COLOR3D_LOOK_AT_REPORT, chromium, page},
                     .log_path = log,
                     .timeout = std::chrono::seconds(150)},
                    CancellationToken());
  const std::string text = ReadFile(log);
  ASSERT_EQ(result.exit_code, 0) << text;
  SCOPED_TRACE(text);
  const auto looked = nlohmann::json::parse(text);
  EXPECT_TRUE(looked.at("errors").empty());
  EXPECT_TRUE(looked.at("requests").empty());
  ASSERT_EQ(looked.at("looks").size(), 4u);
  for (const auto& [name, look] : looked.at("looks").items()) {
    SCOPED_TRACE(name);
    EXPECT_LE(look.at("overflow_px"), 0);
    EXPECT_GT(look.at("first_paint_ms"), 0.0);
    EXPECT_LT(look.at("first_paint_ms"), 2000.0);
    EXPECT_EQ(look.at("views"), 3);
    EXPECT_EQ(look.at("without_text"), 0);
    EXPECT_EQ(look.at("view_changes"), true);
    EXPECT_NE(look.at("clip").get<std::string>().find("80%"), std::string::npos);
  }
  EXPECT_NE(looked.at("looks").at("phone_light").at("background"),
            looked.at("looks").at("phone_dark").at("background"));
}

}  // namespace
}  // namespace color3d
