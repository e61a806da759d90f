#include "core/report/report_page.h"

#include <cstdio>

#include "core/base/base64.h"
#include "core/report/plot.h"

namespace color3d {
namespace {

constexpr const char* kStyle = R"(
:root{color-scheme:light dark}
body{font:15px/1.5 system-ui,sans-serif;max-width:1120px;margin:2rem auto;padding:0 1rem;
background:Canvas;color:CanvasText}
h1{font-size:1.5rem;margin-bottom:.2rem}h2{font-size:1.1rem;margin-top:2rem;border-bottom:1px solid #8884}
.row{display:flex;flex-wrap:wrap;gap:12px;margin:.4rem 0 1rem}
figure{margin:0;flex:1 1 240px;max-width:540px}img{width:100%;border-radius:4px;display:block}
.wide figure{max-width:none}
figcaption{font-size:.85rem;opacity:.75}
table{border-collapse:collapse}td,th{padding:.2rem .8rem .2rem 0;text-align:left;vertical-align:top}
td.v{text-align:right;font-variant-numeric:tabular-nums}
.plots{display:flex;flex-wrap:wrap;gap:8px}.plot{width:360px;max-width:100%}
.plot .t{font-size:12px;fill:currentColor}.plot .n{font-size:10px;fill:currentColor;opacity:.7}
.plot .g{stroke:currentColor;opacity:.15}.plot .c{fill:none;stroke:#2b7de9;stroke-width:1.6}
.go{display:inline-block;padding:.5rem 1rem;border-radius:6px;background:#2b6cb0;color:#fff;
text-decoration:none}
.no{opacity:.6}.warn{border-left:4px solid #e0a000;padding:.1rem .8rem}
)";

std::string Number(double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof(buffer), "%.4g", value);
  return buffer;
}

std::string PictureHtml(const ReportPicture& picture) {
  const bool png = picture.bytes.size() > 1 && picture.bytes[1] == 'P';
  return "<figure><img alt=\"" + EscapeHtml(picture.caption) + "\" src=\"data:image/" +
         (png ? "png" : "jpeg") + ";base64," + Base64(picture.bytes) + "\"><figcaption>" +
         EscapeHtml(picture.caption) + "</figcaption></figure>";
}

std::string RowHtml(const ReportRow& row) {
  std::string html;
  if (!row.title.empty()) html += "<h3>" + EscapeHtml(row.title) + "</h3>";
  html += "<div class=\"row\">";
  for (const ReportPicture& picture : row.pictures) html += PictureHtml(picture);
  return html + "</div>";
}

std::string KeyViewHtml(const ReportKeyView& key) {
  std::string html = "<h2>Key view</h2>";
  for (const std::string& note : key.notes) html += "<p>" + EscapeHtml(note) + "</p>";
  html += RowHtml(key.pictures);
  if (!key.color_facts.empty()) {
    html += "<h3>Its colour</h3><table>";
    for (const auto& [name, text] : key.color_facts) {
      html += "<tr><td>" + EscapeHtml(name) + "</td><td>" + EscapeHtml(text) + "</td></tr>";
    }
    html += "</table>";
  }
  if (!key.ranking.bytes.empty()) {
    html += "<div class=\"wide\">" + PictureHtml(key.ranking) + "</div>";
  }
  return html;
}

std::string TableHtml(const ReportTable& table) {
  std::string html = "<table><tr>";
  for (const std::string& column : table.columns) html += "<th>" + EscapeHtml(column) + "</th>";
  html += "</tr>";
  for (const std::vector<std::string>& row : table.rows) {
    html += "<tr>";
    for (size_t i = 0; i < row.size(); ++i) {
      html += std::string(i == 0 ? "<td>" : "<td class=\"v\">") + EscapeHtml(row[i]) + "</td>";
    }
    html += "</tr>";
  }
  return html + "</table>";
}

std::string CurvesHtml(const std::vector<CurvePoint>& curves) {
  return "<div class=\"plots\">" + PlotsSvg(curves) + "</div>";
}

std::string SectionHtml(const ReportSection& section) {
  std::string html = "<h2>" + EscapeHtml(section.title) + "</h2>";
  for (const std::string& note : section.notes) html += "<p>" + EscapeHtml(note) + "</p>";
  for (const ReportTable& table : section.tables) html += TableHtml(table);
  if (!section.curves.empty()) html += CurvesHtml(section.curves);
  if (!section.wide.bytes.empty()) {
    html += "<div class=\"wide\">" + PictureHtml(section.wide) + "</div>";
  }
  for (const ReportRow& row : section.rows) html += RowHtml(row);
  return html;
}

std::string PlanHtml(const std::vector<PlanStep>& plan) {
  std::string html =
      "<h2>Plan</h2><table><tr><th>step</th><th></th><th>why</th><th>estimate, s</th>"
      "<th>measured, s</th></tr>";
  for (const PlanStep& s : plan) {
    html += std::string(s.needed ? "<tr>" : "<tr class=\"no\">") + "<td>" + EscapeHtml(s.step) +
            "</td><td>" + (s.needed ? "needed" : "left out") + "</td><td>" + EscapeHtml(s.reason) +
            "</td><td class=\"v\">" +
            (s.estimated_seconds > 0 ? Number(s.estimated_seconds) : std::string()) +
            "</td><td class=\"v\">" +
            (s.measured_seconds >= 0 ? Number(s.measured_seconds) : std::string()) + "</td></tr>";
  }
  return html + "</table>";
}

}  // namespace

std::string RenderReport(const ReportData& data) {
  std::string html =
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\"><title>" +
      EscapeHtml(data.title) + "</title><style>" + kStyle + "</style></head><body>";
  html += "<h1>" + EscapeHtml(data.title) + "</h1><p>" + EscapeHtml(data.summary) + "</p>";
  if (!data.view_page.empty()) {
    html += "<p><a class=\"go\" href=\"" + EscapeHtml(data.view_page) +
            "\">Look at the scene in 3D</a></p>";
  }
  for (const std::string& warning : data.warnings) {
    html += "<p class=\"warn\">" + EscapeHtml(warning) + "</p>";
  }
  if (!data.key_view.pictures.pictures.empty()) html += KeyViewHtml(data.key_view);
  for (const ReportSection& section : data.sections) html += SectionHtml(section);
  if (!data.views.empty()) html += "<h2>Views</h2>";
  for (const ReportRow& row : data.views) html += RowHtml(row);
  if (!data.metrics.empty()) {
    html += "<h2>Figures</h2><table>";
    for (const auto& [name, value] : data.metrics) {
      html +=
          "<tr><td>" + EscapeHtml(name) + "</td><td class=\"v\">" + Number(value) + "</td></tr>";
    }
    html += "</table>";
  }
  if (!data.curves.empty()) {
    html += "<h2>Error against time</h2>" + CurvesHtml(data.curves);
  }
  if (!data.plan.empty()) html += PlanHtml(data.plan);
  return html + "</body></html>\n";
}

}  // namespace color3d
