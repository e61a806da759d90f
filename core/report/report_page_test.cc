#include "core/report/report_page.h"

#include <gtest/gtest.h>

#include "core/report/plot.h"

namespace color3d {
namespace {

TEST(ReportPageTest, EscapesTextAndPlotsConstantCurves) {
  ReportData data;
  data.title = "<script>";
  data.views = {
      {"view & more", {{"gray", "photo", "a \"caption\"", std::string("\xff\xd8jpeg"), 4, 3}}}};
  data.curves = {{"s", 1.0, 1, "e", 2.0}, {"s", 1.0, 2, "e", 2.0}};
  const std::string html = RenderReport(data);
  EXPECT_EQ(html.find("<script>"), std::string::npos) << "a single picture needs no slider";
  EXPECT_NE(html.find("&lt;script&gt;"), std::string::npos);
  EXPECT_NE(html.find("data:image/jpeg;base64,/9hqcGVn"), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
  EXPECT_NE(html.find("polyline"), std::string::npos);
}

TEST(ReportPageTest, ShowsPartsOfSections) {
  ReportData data;
  data.sections.push_back(
      {"Where <colour> comes from",
       {"61 % seen & verified."},
       {{{"view", "seen"}, {{"a<b.jpg", "0.61"}}}},
       {"sheet", "\xff\xd8jpeg"},
       {{"a.jpg", {{"provenance", "\x89PNG"}}}},
       {{"personalize", 1.0, 1, "heldout_l1", 2.0}, {"personalize", 2.0, 2, "heldout_l1", 1.0}}});
  data.sections.push_back({"Empty one"});
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("<h2>Where &lt;colour&gt; comes from</h2>"), std::string::npos);
  EXPECT_NE(html.find("61 % seen &amp; verified."), std::string::npos);
  EXPECT_NE(html.find("<tr><td>a&lt;b.jpg</td><td class=\"v\">0.61</td></tr>"), std::string::npos);
  EXPECT_NE(html.find("personalize: heldout_l1"), std::string::npos);
  EXPECT_EQ(PlotsSvg({{"evaluate", 1.0, 0, "delta_e00", 2.0}}), "") << "single points are left out";
  EXPECT_NE(html.find("data:image/png"), std::string::npos);
  EXPECT_TRUE(html.find("<h2>Empty one</h2></section></main></body>") != std::string::npos) << html;
}

TEST(ReportPageTest, SliderStartsAtFirstComparableView) {
  ReportData data;
  data.views = {{"alone.jpg", {{"render", "ours", "rendered", "\xff\xd8r", 4, 3}}},
                {"both.jpg",
                 {{"gray", "photo", "the photo", "\xff\xd8g", 4, 3},
                  {"render", "ours", "rendered", "\xff\xd8r", 4, 3}}}};
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("<option value=\"1\">both.jpg</option>"), std::string::npos);
  EXPECT_EQ(html.find("<option value=\"0\">"), std::string::npos);
  EXPECT_NE(html.find("id=\"view-1\""), std::string::npos) << "the script looks for it";
  EXPECT_LT(html.find("id=\"compare\""), html.find("<h2>")) << "the result comes first";
  EXPECT_NE(html.find("<script>"), std::string::npos);
}

TEST(ReportPageTest, ShowsPlanTimesAndCommands) {
  ReportData data;
  data.plan = {{"key_view_selection", false, "the key view was given", 1.25, -1.0, ""},
               {"luminance_geometry", true, "every scene needs it", 0.0, 14.0, ""}};
  data.stages = {{"solve_chroma", 1.5}, {"export", 0.5}};
  data.facts = {{"seed", "7"}};
  data.repeat = {"color3d colorize PHOTOS -o OUT --key-view 'a<b.jpg'"};
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("Estimated time saved: 1.2 s."), std::string::npos);
  EXPECT_NE(html.find("key view selection: the key view was given"), std::string::npos);
  EXPECT_NE(html.find("<td>solve chroma</td><td class=\"v\">1.5</td>"), std::string::npos);
  EXPECT_NE(html.find("<td class=\"v\">2.0</td>"), std::string::npos) << "the sum";
  EXPECT_NE(html.find("--key-view &#39;a&lt;b.jpg&#39;"), std::string::npos);
  EXPECT_EQ(RenderReport({}).find("Reproduction"), std::string::npos);
}

TEST(ReportPageTest, ComparesPlanWithMeasuredSeconds) {
  ReportData data;
  data.plan = {{"key_view_selection", false, "the key view was given", 1.25, -1.0, ""},
               {"luminance_geometry", true, "every scene needs it", 19.0, 14.0, ""},
               {"chroma", true, "a and b are fitted", 3.0, 2.0, ""}};
  EXPECT_NE(RenderReport(data).find("on two cores: 22 s; measured: 16 s"), std::string::npos);
  for (PlanStep& step : data.plan) step.measured_seconds = -1.0;
  EXPECT_EQ(RenderReport(data).find("Expected before the run"), std::string::npos);
}

TEST(ReportPageTest, ComparesPlanWithMeasuredMemory) {
  constexpr int64_t kMiB = int64_t{1} << 20;
  ReportData data;
  data.plan = {
      {.step = "luminance_geometry",
       .estimated_memory_bytes = 400 * kMiB,
       .measured_memory_bytes = 350 * kMiB},
      {.step = "chroma", .estimated_memory_bytes = 900 * kMiB, .measured_memory_bytes = 870 * kMiB},
      {.step = "corrections", .needed = false, .estimated_memory_bytes = 100 * kMiB}};
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("Expected peak memory: 900 MiB; measured: 870 MiB"), std::string::npos);
  EXPECT_NE(html.find("Estimated peak memory saved: 100 MiB"), std::string::npos);
  EXPECT_NE(html.find("<td class=\"v\">350</td>"), std::string::npos);
  for (PlanStep& step : data.plan) step.measured_memory_bytes = 0;
  EXPECT_EQ(RenderReport(data).find("Expected peak memory"), std::string::npos);
}

TEST(ReportPageTest, ShowsCurveOfWholeRun) {
  ReportData data;
  EXPECT_EQ(RenderReport(data).find("Error against time"), std::string::npos);
  data.run_curve.title = "estimated error of the colours";
  data.run_curve.series = {{"carry color", {{"", 0.0, 0, "", 10.0}, {"", 8.0, 0, "", 3.0}}},
                           {"personalize", {{"", 8.0, 0, "", 3.0}, {"", 18.0, 0, "", 2.0}}}};
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("Error against time"), std::string::npos);
  EXPECT_NE(html.find("aria-label=\"estimated error of the colours\""), std::string::npos);
  EXPECT_NE(html.find("carry color"), std::string::npos) << "a band has its name";
}

TEST(ReportPageTest, ShowsChoiceAndColorOfKeyView) {
  ReportData data;
  data.key_view.pictures = {"a.jpg", {{"as captured", "\x89PNG"}}};
  data.key_view.notes = {"Best of 5 views, narrowly ahead of <b>."};
  data.key_view.ranking = {"all candidates", "\xff\xd8jpeg"};
  data.key_view.color_facts = {{"source", "prompt"}, {"regions", "\"sky\" & lawn"}};
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("narrowly ahead of &lt;b&gt;."), std::string::npos);
  EXPECT_NE(html.find("<td>source</td><td>prompt</td>"), std::string::npos);
  EXPECT_NE(html.find("&amp; lawn"), std::string::npos);
  EXPECT_NE(html.find("data:image/jpeg"), std::string::npos);
  EXPECT_EQ(RenderReport({}).find("Key view"), std::string::npos);
}

TEST(ReportPageTest, ShowsEachAdditionalKeyView) {
  ReportData data;
  data.additional_key_views.resize(2);
  data.additional_key_views[0].pictures = {"b.jpg", {{"as captured", "\x89PNG"}}};
  data.additional_key_views[1].pictures = {"c.jpg", {{"as captured", "\x89PNG"}}};
  data.additional_key_views[1].color_facts = {{"source", "backend"}};
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("b.jpg"), std::string::npos);
  EXPECT_LT(html.find("b.jpg"), html.find("c.jpg"));
  EXPECT_NE(html.find("<td>source</td><td>backend</td>"), std::string::npos);
}

}  // namespace
}  // namespace color3d
