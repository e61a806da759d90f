// The report: one self-contained HTML file (pictures inside, no scripts, nothing fetched).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/report/curves.h"
#include "core/report/scene_plan.h"

namespace color3d {

// Bytes of a JPEG or PNG file with a caption.
struct ReportPicture {
  std::string caption;
  std::string bytes;
};

// Pictures of one view side by side.
struct ReportRow {
  std::string title;
  std::vector<ReportPicture> pictures;
};

// How the key view was chosen and where its colour comes from.
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

// A chapter of any content; what is empty is left out.
struct ReportSection {
  std::string title;
  std::vector<std::string> notes;  // paragraphs of plain text
  std::vector<ReportTable> tables;
  ReportPicture wide;  // over the whole width
  std::vector<ReportRow> rows;
  std::vector<CurvePoint> curves;
};

struct ReportData {
  std::string title;
  std::string summary;    // one paragraph of plain text
  std::string view_page;  // file beside the report that shows the scene in 3D; empty: none
  ReportKeyView key_view;
  std::vector<ReportSection> sections;  // between the key view and the views
  std::vector<ReportRow> views;
  std::vector<std::pair<std::string, double>> metrics;
  std::vector<CurvePoint> curves;
  std::vector<PlanStep> plan;
  std::vector<std::string> warnings;
};

std::string RenderReport(const ReportData& data);

}  // namespace color3d
