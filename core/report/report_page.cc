#include "core/report/report_page.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/text/base64.h"
#include "core/report/page_style.h"
#include "core/report/plot.h"

namespace color3d {
namespace {

std::string Number(double value) { return fmt::format("{:.4g}", value); }

std::string DataUrl(const std::string& bytes) {
  const bool png = bytes.size() > 1 && bytes[1] == 'P';
  return fmt::format("data:image/{};base64,{}", png ? "png" : "jpeg", Base64(bytes));
}

std::string PictureHtml(const ReportPicture& picture) {
  return fmt::format(
      "<figure><img loading=\"lazy\" decoding=\"async\" alt=\"{0}\" src=\"{1}\">"
      "<figcaption>{0}</figcaption></figure>",
      EscapeHtml(picture.caption),
      DataUrl(picture.bytes));
}

std::string RowHtml(const ReportRow& row) {
  std::string html;
  if (!row.title.empty()) html += "<h3>" + EscapeHtml(row.title) + "</h3>";
  html += "<div class=\"row\">";
  for (const ReportPicture& picture : row.pictures) html += PictureHtml(picture);
  return html + "</div>";
}

std::string ChapterStart(const std::string& title) {
  return "<section><h2>" + EscapeHtml(title) + "</h2>";
}

std::string Paragraphs(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<p>" + EscapeHtml(text) + "</p>";
  return html;
}

const ReportView::Picture* FindPicture(const ReportView& view, const std::string& role) {
  for (const ReportView::Picture& picture : view.pictures) {
    if (picture.role == role) return &picture;
  }
  return nullptr;
}

bool CanBeCompared(const ReportView& view) {
  return view.pictures.size() > 1 && FindPicture(view, "render") != nullptr;
}

std::string Dimensions(const ReportView::Picture& picture) {
  return fmt::format(" width=\"{}\" height=\"{}\"", picture.width, picture.height);
}

// Holds the pictures shown first; the script takes the others from ViewsHtml.
std::string SliderHtml(const std::vector<ReportView>& views) {
  const auto first = std::find_if(views.begin(), views.end(), CanBeCompared);
  if (first == views.end()) return "";
  const ReportView::Picture& render = *FindPicture(*first, "render");
  const ReportView::Picture& before =
      *std::find_if(first->pictures.begin(), first->pictures.end(), [](const auto& picture) {
        return picture.role != "render";
      });
  std::string html = fmt::format(
      "<section aria-label=\"Before and after\"><div class=\"compare\" id=\"compare\" "
      "style=\"--at:50%;--shape:{}/{}\"><img alt=\"{}\"{} src=\"{}\">"
      "<img class=\"over\" alt=\"{}\"{} src=\"{}\"><div class=\"bar\"></div>"
      "<span class=\"l\">{}</span><span class=\"r\">{}</span></div>"
      "<div class=\"controls\" id=\"controls\" hidden><label>Before and after"
      "<input type=\"range\" id=\"at\" min=\"0\" max=\"100\" value=\"50\"></label>"
      "<label>View<select id=\"view\">",
      render.width,
      render.height,
      EscapeHtml(render.caption),
      Dimensions(render),
      DataUrl(render.bytes),
      EscapeHtml(before.caption),
      Dimensions(before),
      DataUrl(before.bytes),
      EscapeHtml(before.short_name),
      EscapeHtml(render.short_name));
  for (size_t i = 0; i < views.size(); ++i) {
    if (!CanBeCompared(views[i])) continue;
    html += fmt::format("<option value=\"{}\">{}</option>", i, EscapeHtml(views[i].name));
  }
  return html + "</select></label><label>Compare with<select id=\"pair\"><option value=\"" +
         before.role + "\"></option></select></label></div></section>";
}

std::string ViewsHtml(const std::vector<ReportView>& views) {
  if (views.empty()) return "";
  std::string html =
      ChapterStart("Views") +
      fmt::format("<details><summary>All {} views side by side</summary>", views.size());
  for (size_t i = 0; i < views.size(); ++i) {
    html += fmt::format(
        "<article id=\"view-{}\"><h3>{}</h3><div class=\"row\">", i, EscapeHtml(views[i].name));
    for (const ReportView::Picture& picture : views[i].pictures) {
      html += fmt::format(
          "<figure><img loading=\"lazy\" decoding=\"async\" data-role=\"{}\" data-short=\"{}\"{} "
          "alt=\"{}\" src=\"{}\"><figcaption>{}</figcaption></figure>",
          picture.role,
          EscapeHtml(picture.short_name),
          Dimensions(picture),
          EscapeHtml(picture.caption + ", " + views[i].name),
          DataUrl(picture.bytes),
          EscapeHtml(picture.caption));
    }
    html += "</div></article>";
  }
  return html + "</details></section>";
}

std::string KeyViewHtml(const std::string& title, const ReportKeyView& key) {
  std::string html = ChapterStart(title) + Paragraphs(key.notes);
  html += RowHtml(key.pictures);
  if (!key.color_facts.empty()) {
    html += "<h3>Colour</h3><div class=\"box\"><table>";
    for (const auto& [name, text] : key.color_facts) {
      html += fmt::format("<tr><td>{}</td><td>{}</td></tr>", EscapeHtml(name), EscapeHtml(text));
    }
    html += "</table></div>";
  }
  if (!key.ranking.bytes.empty()) {
    html += "<div class=\"wide\">" + PictureHtml(key.ranking) + "</div>";
  }
  return html + "</section>";
}

std::string TableHtml(const ReportTable& table) {
  std::string html = "<div class=\"box\"><table><tr>";
  for (size_t i = 0; i < table.columns.size(); ++i) {
    html += std::string(i == 0 ? "<th scope=\"col\">" : "<th scope=\"col\" class=\"v\">") +
            EscapeHtml(table.columns[i]) + "</th>";
  }
  html += "</tr>";
  for (const std::vector<std::string>& row : table.rows) {
    html += "<tr>";
    for (size_t i = 0; i < row.size(); ++i) {
      html += std::string(i == 0 ? "<td>" : "<td class=\"v\">") + EscapeHtml(row[i]) + "</td>";
    }
    html += "</tr>";
  }
  return html + "</table></div>";
}

std::string CurvesHtml(const std::vector<CurvePoint>& curves) {
  return "<div class=\"plots\">" + PlotsSvg(curves) + "</div>";
}

std::string ErrorAgainstTimeHtml(const ReportData& data) {
  if (data.curves.empty() && data.run_curve.series.empty()) return "";
  std::string html = ChapterStart("Error against time");
  if (!data.run_curve.series.empty()) {
    html +=
        "<p>The first plot is the whole run, by stage: the estimated error of the colours, "
        "against seconds of computing.</p><div class=\"plots\">" +
        PlotSvg(data.run_curve) + "</div>";
  }
  return html + CurvesHtml(data.curves) + "</section>";
}

std::string SectionHtml(const ReportSection& section) {
  std::string html = ChapterStart(section.title) + Paragraphs(section.notes);
  if (!section.legend.empty()) {
    html += "<ul class=\"legend\">";
    for (const ReportShade& shade : section.legend) {
      html += fmt::format(
          "<li><i class=\"{}\"></i><span>{}</span></li>", shade.kind, EscapeHtml(shade.text));
    }
    html += "</ul>";
  }
  if (!section.rows.empty()) html += "<div class=\"rows\">";
  for (const ReportRow& row : section.rows) html += "<div>" + RowHtml(row) + "</div>";
  if (!section.rows.empty()) html += "</div>";
  for (const ReportTable& table : section.tables) html += TableHtml(table);
  if (!section.curves.empty()) html += CurvesHtml(section.curves);
  if (!section.wide.bytes.empty()) {
    html += "<div class=\"wide\">" + PictureHtml(section.wide) + "</div>";
  }
  return html + "</section>";
}

std::string Seconds(double seconds) { return seconds > 0.0 ? Number(seconds) : std::string(); }

std::string MiB(int64_t bytes) {
  return bytes > 0 ? fmt::format("{}", (bytes + (1 << 19)) >> 20) : std::string();
}

// The estimates beside the measured seconds and peak memory, over the stages that have both; empty
// without them.
std::string PlanCheckHtml(const std::vector<PlanStep>& plan) {
  double estimated = 0.0, measured = 0.0;
  int64_t estimated_bytes = 0, measured_bytes = 0;
  for (const PlanStep& step : plan) {
    if (step.needed && step.measured_memory_bytes > 0) {
      estimated_bytes = std::max(estimated_bytes, step.estimated_memory_bytes);
      measured_bytes = std::max(measured_bytes, step.measured_memory_bytes);
    }
    if (!step.needed || step.measured_seconds < 0.0 || !(step.estimated_seconds > 0.0)) continue;
    estimated += step.estimated_seconds;
    measured += step.measured_seconds;
  }
  std::string html;
  if (measured > 0.0) {
    html =
        fmt::format("<p>Expected before the run, on two cores: {:.0f} s; measured: {:.0f} s.</p>",
                    estimated,
                    measured);
  }
  if (estimated_bytes > 0) {
    html += fmt::format("<p>Expected peak memory: {} MiB; measured: {} MiB.</p>",
                        MiB(estimated_bytes),
                        MiB(measured_bytes));
  }
  return html;
}

// Steps left out come first, since no other chapter shows them.
std::string PlanHtml(const std::vector<PlanStep>& plan) {
  double saved = 0.0;
  int64_t saved_bytes = 0;
  for (const PlanStep& step : plan) {
    if (step.needed) continue;
    saved += step.estimated_seconds;
    saved_bytes = std::max(saved_bytes, step.estimated_memory_bytes);
  }
  std::string html = ChapterStart("Steps left out");
  if (saved >= 0.05) html += fmt::format("<p>Estimated time saved: {:.1f} s.</p>", saved);
  if (saved_bytes > 0) {
    html += fmt::format("<p>Estimated peak memory saved: {} MiB.</p>", MiB(saved_bytes));
  }
  ReportTable left_out{{"step", "saved, s", "saved, MiB"}, {}};
  ReportTable done{{"step", "estimate, s", "measured, s", "estimate, MiB", "measured, MiB"}, {}};
  for (const PlanStep& step : plan) {
    std::string name = step.step + ": " + step.reason;
    std::replace(name.begin(), name.begin() + static_cast<int>(step.step.size()), '_', ' ');
    if (step.needed) {
      done.rows.push_back({name,
                           Seconds(step.estimated_seconds),
                           Seconds(step.measured_seconds),
                           MiB(step.estimated_memory_bytes),
                           MiB(step.measured_memory_bytes)});
    } else {
      left_out.rows.push_back(
          {name, Seconds(step.estimated_seconds), MiB(step.estimated_memory_bytes)});
    }
  }
  if (!left_out.rows.empty()) html += TableHtml(left_out);
  html += PlanCheckHtml(plan);
  if (!done.rows.empty()) {
    html += "<details><summary>Steps carried out, with reasons</summary>" + TableHtml(done) +
            "</details>";
  }
  return html + "</section>";
}

std::string StagesHtml(const std::vector<ReportStage>& stages) {
  double longest = 0.0, total = 0.0;
  for (const ReportStage& stage : stages) {
    longest = std::max(longest, stage.seconds);
    total += stage.seconds;
  }
  if (!(longest > 0.0)) return "";
  std::string html = ChapterStart("Seconds by stage") +
                     "<div class=\"box\"><table><tr><th scope=\"col\">stage</th>"
                     "<th scope=\"col\" class=\"v\">seconds</th><td></td></tr>";
  for (const ReportStage& stage : stages) {
    std::string name = stage.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    html += fmt::format(
        "<tr><td>{}</td><td class=\"v\">{:.1f}</td><td>"
        "<meter aria-hidden=\"true\" value=\"{:.3f}\"></meter></td></tr>",
        EscapeHtml(name),
        stage.seconds,
        stage.seconds / longest);
  }
  return html + fmt::format(
                    "<tr><th scope=\"row\">all</th><td class=\"v\">{:.1f}</td><td></td></tr>"
                    "</table></div></section>",
                    total);
}

std::string FiguresHtml(const std::vector<std::pair<std::string, double>>& metrics) {
  if (metrics.empty()) return "";
  ReportTable table{{"figure", "value"}, {}};
  for (const auto& [name, value] : metrics) table.rows.push_back({name, Number(value)});
  return ChapterStart("Figures") + "<details><summary>All figures of metrics.json</summary>" +
         TableHtml(table) + "</details></section>";
}

std::string RepeatHtml(const ReportData& data) {
  if (data.facts.empty() && data.repeat.empty()) return "";
  std::string html = ChapterStart("Reproduction");
  html += Paragraphs(data.repeat_notes);
  if (!data.repeat.empty()) {
    html += "<pre>";
    for (const std::string& command : data.repeat) html += EscapeHtml(command) + "\n";
    html += "</pre>";
  }
  if (data.facts.empty()) return html + "</section>";
  html += "<div class=\"box\"><table>";
  for (const auto& [name, text] : data.facts) {
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th>"
        "<td style=\"overflow-wrap:anywhere;min-width:9rem\">{}</td></tr>",
        EscapeHtml(name),
        EscapeHtml(text));
  }
  return html + "</table></div></section>";
}

std::string HeadlineHtml(const ReportData& data) {
  if (data.headline.empty()) return "";
  std::string html = "<dl class=\"figures\">";
  for (const auto& [name, text] : data.headline) {
    html += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>", EscapeHtml(name), EscapeHtml(text));
  }
  return html + "</dl>";
}

}  // namespace

std::string RenderReport(const ReportData& data) {
  std::string html = fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<link rel=\"icon\" href=\"data:,\"><title>{0}</title><style>{1}</style></head><body><header>"
      "<h1>{0}</h1><p>{2}</p></header><main>{3}",
      EscapeHtml(data.title),
      kReportStyle,
      EscapeHtml(data.summary),
      SliderHtml(data.views));
  if (!data.view_page.empty()) {
    html += fmt::format("<p><a class=\"go\" href=\"{}\">Look at the scene in 3D</a></p>",
                        EscapeHtml(data.view_page));
  }
  html += HeadlineHtml(data);
  for (const std::string& warning : data.warnings) {
    html += "<p class=\"warn\">" + EscapeHtml(warning) + "</p>";
  }
  if (!data.key_view.pictures.pictures.empty() || !data.key_view.ranking.bytes.empty()) {
    html += KeyViewHtml("Key view", data.key_view);
  }
  for (const ReportKeyView& key : data.additional_key_views) {
    html += KeyViewHtml("Additional key view", key);
  }
  for (const ReportSection& section : data.sections) html += SectionHtml(section);
  html += ViewsHtml(data.views);
  html += ErrorAgainstTimeHtml(data);
  if (!data.plan.empty()) html += PlanHtml(data.plan);
  html += StagesHtml(data.stages) + FiguresHtml(data.metrics) + RepeatHtml(data);
  html += "</main>";
  if (std::any_of(data.views.begin(), data.views.end(), CanBeCompared)) {
    html += std::string("<script>") + kReportScript + "</script>";
  }
  return html + "</body></html>\n";
}

}  // namespace color3d
