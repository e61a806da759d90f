// The report: one self-contained HTML file for phones and desktops, light and dark. Pictures and a
// small script are embedded, nothing is fetched; without scripts only the slider does not work.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/report/curves.h"
#include "core/report/plot.h"
#include "core/report/scene_plan.h"

namespace color3d {

// Bytes of a JPEG or PNG file with a caption.
struct ReportPicture {
  std::string caption;
  std::string bytes;
};

// A view with the pictures that can be compared.
struct ReportView {
  // `role`: "render", "gray", "truth" or "direct"; at most one of each.
  struct Picture {
    std::string role;
    std::string short_name;  // label on the picture
    std::string caption;
    std::string bytes;
    int width = 0, height = 0;  // px
  };
  std::string name;  // label, e.g. "a.jpg (held out)"
  std::vector<Picture> pictures;
};

// Legend of a shade of an overlay: "seen", "inferred" or "guessed".
struct ReportShade {
  std::string kind;
  std::string text;
};

struct ReportStage {
  std::string name;
  double seconds = 0.0;
};

// Pictures of one view side by side.
struct ReportRow {
  std::string title;
  std::vector<ReportPicture> pictures;
};

// How a key view was chosen and the source of its colour.
struct ReportKeyView {
  ReportRow pictures;
  std::vector<std::string> notes;  // paragraphs of plain text
  ReportPicture ranking;           // contact sheet over the whole width; may be empty
  std::vector<std::pair<std::string, std::string>> color_facts;
};

struct ReportTable {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // the first column is a name, the others numbers
};

// A chapter. Empty parts are left out.
struct ReportSection {
  std::string title;
  std::vector<std::string> notes;  // paragraphs of plain text
  std::vector<ReportTable> tables;
  ReportPicture wide;  // over the whole width
  std::vector<ReportRow> rows;
  std::vector<CurvePoint> curves;
  std::vector<ReportShade> legend = {};  // of the rows
};

struct ReportData {
  std::string title;
  std::string summary;    // one paragraph of plain text
  std::string view_page;  // file beside the report that shows the scene in 3D; empty: none
  ReportKeyView key_view;
  std::vector<ReportKeyView> additional_key_views;  // a chapter each, after the key view
  std::vector<ReportSection> sections;              // between the key view and the views
  // The slider offers the views with a render and another picture, and starts with the first one.
  std::vector<ReportView> views;
  std::vector<std::pair<std::string, std::string>>
      headline;  // the most important metrics, in words
  std::vector<std::pair<std::string, double>> metrics;
  Plot run_curve;  // of the whole run; without series: none
  std::vector<CurvePoint> curves;
  std::vector<PlanStep> plan;
  std::vector<ReportStage> stages;  // stages that ran
  std::vector<std::string> warnings;
  std::vector<std::pair<std::string, std::string>> facts;  // versions, seeds, digests, licences
  std::vector<std::string> repeat_notes;
  std::vector<std::string> repeat;  // shell commands
};

std::string RenderReport(const ReportData& data);

}  // namespace color3d
