#include "core/report/report_page.h"

#include <gtest/gtest.h>

#include "core/report/plot.h"

namespace color3d {
namespace {

TEST(Report, EscapesTextAndPlotsConstantCurves) {
  ReportData data;
  data.title = "<script>";
  data.views = {{"view & more", {{"a \"caption\"", std::string("\xff\xd8jpeg")}}}};
  data.curves = {{"s", 1.0, 1, "e", 2.0}, {"s", 1.0, 2, "e", 2.0}};
  const std::string html = RenderReport(data);
  EXPECT_EQ(html.find("<script>"), std::string::npos);
  EXPECT_NE(html.find("&lt;script&gt;"), std::string::npos);
  EXPECT_NE(html.find("data:image/jpeg;base64,/9hqcGVn"), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
  EXPECT_NE(html.find("polyline"), std::string::npos);
}

TEST(Report, SectionsShowWhatTheyHave) {
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
  EXPECT_EQ(PlotsSvg({{"evaluate", 1.0, 0, "delta_e00", 2.0}}), "") << "one point is no curve";
  EXPECT_NE(html.find("data:image/png"), std::string::npos);
  EXPECT_TRUE(html.find("<h2>Empty one</h2></body>") != std::string::npos) << html;
}

TEST(Report, KeyViewSectionTellsChoiceAndColour) {
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

}  // namespace
}  // namespace color3d
