#include "tests/bench/suite/suite_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/report/plot.h"

namespace color3d {
namespace {

constexpr char kStyle[] = R"css(
:root{color-scheme:light dark;--page:#fbfaf8;--text:#1d1f21;--soft:#5b6166;--line:#dcdad5;--accent:#1f5fa8;--mark:#d9821a}
@media(prefers-color-scheme:dark){:root{--page:#15171a;--text:#e9e7e3;--soft:#a3a9af;--line:#34383d;--accent:#7db4f0}}
*{box-sizing:border-box}
body{font:16px/1.55 system-ui,sans-serif;margin:0 auto;max-width:1120px;padding:1.25rem 1rem;background:var(--page);color:var(--text)}
h1{font-size:1.5rem;margin:0}h2{font-size:1.2rem;margin:2.25rem 0 .5rem}p{max-width:75ch;margin:.4rem 0}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.9rem}
th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid var(--line);white-space:nowrap}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}td.w{white-space:normal;min-width:16rem}
tr.ours td{font-weight:600}tr.oracle td,tr.failed td,.soft{color:var(--soft)}
svg{width:100%;max-width:760px;height:auto;display:block}svg text{fill:var(--text);font:12px system-ui,sans-serif}
.axis{stroke:var(--line)}.dot{fill:var(--soft)}.front{fill:var(--accent)}.path{stroke:var(--accent);fill:none;stroke-width:1.5}
.knee{fill:none;stroke:var(--mark);stroke-width:2}
)css";

constexpr double kWidth = 760, kHeight = 340, kLeft = 50, kRight = 140, kTop = 12, kBottom = 40;

std::string Number(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "";
}

// A place in the figure.
struct Place {
  double x = 0.0, y = 0.0;
};

class Axes {
 public:
  explicit Axes(const std::vector<const SuiteCell*>& cells) {
    for (const SuiteCell* cell : cells) {
      const double seconds = std::log10(cell->Mean("seconds_total"));
      low_ = std::min(low_, std::floor(seconds * 2.0) / 2.0);
      high_ = std::max(high_, std::ceil(seconds * 2.0) / 2.0);
      most_ = std::max(most_, std::ceil(cell->error.mean + 0.2));
    }
    if (high_ <= low_) high_ = low_ + 0.5;
  }
  Place Of(const SuiteCell& cell) const {
    return {X(std::log10(cell.Mean("seconds_total"))), Y(cell.error.mean)};
  }
  std::string Svg() const {
    std::string svg;
    for (double s = std::ceil(low_ * 2.0) / 2.0; s <= high_ + 1e-9; s += 0.5) {
      svg += fmt::format(
          "<line class=\"axis\" x1=\"{0:.0f}\" x2=\"{0:.0f}\" y1=\"{1:.0f}\" y2=\"{2:.0f}\"/>"
          "<text x=\"{0:.0f}\" y=\"{3:.0f}\" text-anchor=\"middle\">{4:.0f} s</text>",
          X(s),
          kTop,
          kHeight - kBottom,
          kHeight - kBottom + 16,
          std::pow(10.0, s));
    }
    const double step = most_ > 8.0 ? 2.0 : 1.0;
    for (double e = 0.0; e <= most_ + 1e-9; e += step) {
      svg += fmt::format(
          "<line class=\"axis\" x1=\"{0:.0f}\" x2=\"{1:.0f}\" y1=\"{2:.0f}\" y2=\"{2:.0f}\"/>"
          "<text x=\"{3:.0f}\" y=\"{4:.0f}\" text-anchor=\"end\">{5:.0f}</text>",
          kLeft,
          kWidth - kRight,
          Y(e),
          kLeft - 6,
          Y(e) + 4,
          e);
    }
    return svg;
  }

 private:
  double X(double log_seconds) const {
    return kLeft + (log_seconds - low_) / (high_ - low_) * (kWidth - kLeft - kRight);
  }
  double Y(double error) const {
    return kHeight - kBottom - error / most_ * (kHeight - kTop - kBottom);
  }
  double low_ = 1e9, high_ = -1e9, most_ = 1.0;
};

// Class of a table row.
std::string StyleOf(const SuitePreset& preset) {
  const std::string kind = KindOf(preset);
  return kind == "oracle" || kind == "ours" ? kind : "";
}

std::string Row(const SuiteCell& cell, const std::string& mark) {
  const std::string interval = HasInterval(cell.error)
                                   ? fmt::format(" <span class=\"soft\">{} to {}</span>",
                                                 Number(cell.error.low, 2),
                                                 Number(cell.error.high, 2))
                                   : "";
  return fmt::format(
      "<tr class=\"{}\"><td title=\"{}\">{}</td><td class=\"n\">{}{}</td><td "
      "class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>"
      "<td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>"
      "<td>{}</td></tr>\n",
      StyleOf(cell.preset),
      EscapeHtml(cell.preset.claim),
      EscapeHtml(cell.preset.name),
      Number(cell.error.mean, 2),
      interval,
      Number(cell.Mean("delta_e00_chroma_2d"), 2),
      Number(cell.Mean("psnr_l"), 1),
      Number(cell.Mean("colorfulness_ratio"), 2),
      Number(cell.Mean("me_common"), 4),
      Number(cell.Mean("gaussians"), 0),
      Number(cell.Mean("seconds_total"), 0),
      cell.rows.size(),
      mark);
}

std::string SceneSection(const SceneResults& scene) {
  std::string html = fmt::format("<h2>{}</h2>\n<p>Without colour: {}.</p>\n{}",
                                 EscapeHtml(scene.scene),
                                 Number(scene.gray, 2),
                                 FrontierSvg(scene));
  html +=
      "<div class=\"scroll\"><table><tr><th>preset</th><th class=\"n\">error, 95 %</th>"
      "<th class=\"n\">photos</th><th class=\"n\">PSNR of L</th><th class=\"n\">colourfulness</th>"
      "<th class=\"n\">ME, common</th><th class=\"n\">Gaussians</th><th class=\"n\">s</th>"
      "<th class=\"n\">seeds</th><th></th></tr>\n";
  for (size_t i = 0; i < scene.cells.size(); ++i) {
    const bool is_oracle = scene.cells[i].preset.oracle;
    html += Row(scene.cells[i], is_oracle ? "oracle" : FrontierMark(scene, i));
  }
  for (const SuiteCell& cell : scene.failed) {
    html += fmt::format(
        "<tr class=\"failed\"><td>{}</td><td class=\"w\" colspan=\"9\">failed: {}</td></tr>\n",
        EscapeHtml(cell.preset.name),
        EscapeHtml(cell.failure));
  }
  return html + "</table></div>\n";
}

std::string Overview(const std::vector<PresetSummary>& presets) {
  std::string html =
      "<h2>All scenes</h2>\n<div class=\"scroll\"><table><tr><th>preset</th><th>kind</th>"
      "<th class=\"n\">scenes</th><th class=\"n\">error / default</th>"
      "<th class=\"n\">time / default</th><th>tests</th></tr>\n";
  for (const PresetSummary& p : presets) {
    html += fmt::format(
        "<tr class=\"{}\"><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>"
        "<td class=\"n\">{}</td><td class=\"w\">{}</td></tr>\n",
        StyleOf(p.preset),
        EscapeHtml(p.preset.name),
        EscapeHtml(KindOf(p.preset)),
        p.scenes,
        Number(p.error_ratio, 2),
        Number(p.time_ratio, 2),
        EscapeHtml(p.preset.claim));
  }
  return html + "</table></div>\n";
}

std::string ClaimSection(const std::vector<ClaimResult>& claims) {
  std::string html =
      "<h2>Claims of the paper</h2>\n<p>The ratio is the metric of the first preset over that of "
      "the "
      "second, smaller is better for the claim.</p>\n<div "
      "class=\"scroll\"><table><tr><th>claim</th>"
      "<th>compared</th><th>metric</th><th class=\"n\">scenes</th><th class=\"n\">ratio</th>"
      "<th>verdict</th></tr>\n";
  for (const ClaimResult& result : claims) {
    const bool tested = result.scenes > 0;
    html += fmt::format(
        "<tr><td class=\"w\">{}</td><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}"
        "</td><td>{}</td></tr>\n",
        EscapeHtml(result.claim.text),
        *result.claim.better == '\0'
            ? EscapeHtml(result.claim.note)
            : EscapeHtml(fmt::format("{} against {}", result.claim.better, result.claim.worse)),
        EscapeHtml(result.claim.metric),
        tested ? fmt::format("{} of {}", result.holds_on, result.scenes) : "",
        tested ? fmt::format("{:.2f}", result.ratio) : "",
        EscapeHtml(result.verdict));
  }
  return html + "</table></div>\n";
}

}  // namespace

std::string FrontierSvg(const SceneResults& scene) {
  std::vector<const SuiteCell*> cells;
  for (const SuiteCell& cell : scene.cells) {
    if (!cell.preset.oracle && cell.Mean("seconds_total") > 0.0) cells.push_back(&cell);
  }
  if (cells.empty()) return "";
  const Axes axes(cells);
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"Error against seconds\">{}",
      kWidth,
      kHeight,
      axes.Svg());
  std::string path;
  for (const size_t i : scene.frontier) {
    const Place at = axes.Of(scene.cells[i]);
    path += fmt::format("{:.1f},{:.1f} ", at.x, at.y);
  }
  svg += fmt::format("<polyline class=\"path\" points=\"{}\"/>", path);
  for (const SuiteCell* cell : cells) {
    const auto index = static_cast<size_t>(cell - scene.cells.data());
    const auto front = std::find(scene.frontier.begin(), scene.frontier.end(), index);
    const bool on_frontier = front != scene.frontier.end();
    const Place at = axes.Of(*cell);
    svg += fmt::format(
        "<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"><title>{}: {:.2f}, "
        "{:.0f} s</title></circle>",
        on_frontier ? "front" : "dot",
        at.x,
        at.y,
        EscapeHtml(cell->preset.name),
        cell->error.mean,
        cell->Mean("seconds_total"));
    if (on_frontier && front - scene.frontier.begin() == scene.knee) {
      svg +=
          fmt::format("<circle class=\"knee\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"8\"/>", at.x, at.y);
    }
    if (on_frontier || cell->preset.kind != "ablation") {
      svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>",
                         at.x + 8,
                         at.y + 4,
                         EscapeHtml(cell->preset.name));
    }
  }
  return svg + "</svg>\n";
}

std::string SuitePage(const std::vector<SceneResults>& scenes,
                      const std::vector<PresetSummary>& presets,
                      const std::vector<ClaimResult>& claims,
                      const std::string& note) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>Color3D: benchmark</title><style>{}"
      "</style></head><body>\n<h1>Color3D: benchmark</h1>\n"
      "<p>Error: mean CIEDE2000 of chroma of held-out views under their true luminance, renders of "
      "the coloured scene; one key view was given in its true colours. Smaller is better. "
      "Intervals: "
      "95 %, bootstrap over views and seeds. Seconds: of all stages as measured when they ran, "
      "poses "
      "given; stages that equal runs share ran once. Rows marked oracle use true colours that a "
      "user "
      "does not have.</p>\n<p class=\"soft\">{}</p>\n",
      kStyle,
      EscapeHtml(note));
  html += Overview(presets) + ClaimSection(claims);
  html +=
      "<p class=\"soft\">Frontier: no other row is both faster and better. Knee (ring): the point "
      "of "
      "the frontier farthest from the line between its ends, in log seconds and error.</p>\n";
  for (const SceneResults& scene : scenes) html += SceneSection(scene);
  return html + "</body></html>\n";
}

}  // namespace color3d
