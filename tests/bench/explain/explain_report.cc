#include "tests/bench/explain/explain_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/draw.h"

namespace color3d {
namespace {

constexpr int kCellPx = 220;  // longer side of a picture in the figure
constexpr int kGapPx = 6;
constexpr int kTextPx = 10;
constexpr int kLinePx = 22;
constexpr DrawColor kInk = {0.15f, 0.15f, 0.15f};

std::vector<Image> MapsOf(const std::vector<FeatureColumn>& columns,
                          const std::function<const Image&(const FeatureColumn&)>& get) {
  std::vector<const Image*> maps;
  for (const FeatureColumn& column : columns) maps.push_back(&get(column));
  return PrincipalMaps(maps);
}

std::string Figure(double value) { return fmt::format("{:.3g}", value); }

std::string FeatureRow(const std::string& name, const FeatureDistance& distance) {
  return fmt::format("| {} | {} | {} | {:.2f} |\n",
                     name,
                     Figure(distance.matched),
                     Figure(distance.unmatched),
                     distance.Ratio());
}

std::string FeatureTable(const ExplainFacts& facts, const std::vector<ModelStudy>& studies) {
  std::string text =
      "## Distance of features\n\n"
      "Mean distance of the features of one surface in two views, and of different surfaces. "
      "Ratio 0: a surface looks the same in all views; 1: no more alike than any two.\n\n"
      "| features | one surface | different surfaces | ratio |\n|---|--:|--:|--:|\n";
  const ModelStudy& before = studies[0];
  const ModelStudy& after = studies[1];
  for (size_t i = 0; i < before.taps.size(); ++i) {
    const std::string name = fmt::format("encoder, stride {} px", facts.strides[i]);
    text += FeatureRow(name + (facts.has_adapters ? ", before" : ""), before.taps[i]);
    if (facts.has_adapters) text += FeatureRow(name + ", after", after.taps[i]);
  }
  text += FeatureRow("decoder, before", before.decoder);
  text += FeatureRow("decoder, after", after.decoder);
  text += FeatureRow("ab (Lab units), before", before.color);
  return text + FeatureRow("ab (Lab units), after", after.color) + "\n";
}

std::string ConsistencyTable(const std::vector<ModelStudy>& studies) {
  std::string text =
      "## Consistency term\n\n"
      "Variance of the answers over augmentations, mapped back (Lab units squared): V_psi of the "
      "paper's appendix. Colour difference: mean |ab difference| of one surface in two views. All "
      "three fall with the colours themselves, so the mean chroma stands beside them, and the "
      "error against the truth.\n\n"
      "| model | variance, key view | variance, other views | colour difference | chroma | "
      "ΔE00 of the network alone |\n|---|--:|--:|--:|--:|--:|\n";
  for (const ModelStudy& study : studies) {
    text += fmt::format("| {} | {} | {} | {} | {} | {:.2f} |\n",
                        study.name,
                        Figure(study.key_spread.variance),
                        Figure(study.other_spread.variance),
                        Figure(study.color.matched),
                        Figure(study.other_spread.chroma),
                        study.delta_e00);
  }
  return text + "\n";
}

std::string BoundTable(const std::vector<ModelStudy>& studies) {
  std::string text =
      "## The paper's bound\n\n"
      "Δc ≤ L_ψ (L_φ |I − I'| + ε_φ + δ_eq), on patches of L in units of 100, ab in Lab units. L: "
      "largest Jacobian norm at sampled points (power iteration); ratio: largest observed "
      "|φ(I) − φ(I')| / |I − I'| and Δc / |φ(I) − φ(I')|. ε_φ, δ_eq: the largest observed.\n\n"
      "| model | L_φ | ratio | L_ψ | ratio | norm of the whole | L_φ L_ψ | ε_φ | δ_eq | mean Δc | "
      "mean bound | bound / Δc | holds |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";
  for (const ModelStudy& study : studies) {
    const ColorBound& bound = study.bound;
    text +=
        fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.0f} % |\n",
                    study.name,
                    Figure(study.norms.encoder),
                    Figure(bound.encoder_ratio),
                    Figure(study.norms.decoder),
                    Figure(bound.decoder_ratio),
                    Figure(study.norms.whole),
                    Figure(study.norms.encoder * study.norms.decoder),
                    Figure(bound.residual),
                    Figure(bound.equivariance),
                    Figure(bound.color),
                    Figure(bound.bound),
                    bound.color > 0.0 ? Figure(bound.bound / bound.color) : "–",
                    100.0 * bound.holds);
  }
  return text + "\n";
}

}  // namespace

Image FeaturePicture(const std::vector<FeatureColumn>& columns) {
  struct Row {
    const char* title;
    std::vector<Image> pictures;
  };
  std::vector<Image> gray, colored;
  for (const FeatureColumn& column : columns) {
    gray.push_back(SrgbFromLab(column.luminance));
    colored.push_back(column.after.colored);
  }
  const std::vector<Row> rows = {
      {"photo", gray},
      {"encoder",
       MapsOf(columns, [](const FeatureColumn& c) -> const Image& { return c.before.tap; })},
      {"decoder before training",
       MapsOf(columns, [](const FeatureColumn& c) -> const Image& { return c.before.decoder; })},
      {"decoder after training",
       MapsOf(columns, [](const FeatureColumn& c) -> const Image& { return c.after.decoder; })},
      {"answer", colored}};
  const Image& first = columns[0].luminance;
  const double scale = static_cast<double>(kCellPx) / std::max(first.width, first.height);
  const int width = std::max(1, static_cast<int>(scale * first.width));
  const int height = std::max(1, static_cast<int>(scale * first.height));
  Image canvas(kGapPx + static_cast<int>(columns.size()) * (width + kGapPx),
               kLinePx + static_cast<int>(rows.size()) * (kLinePx + height),
               3,
               1.0f);
  for (size_t i = 0; i < columns.size(); ++i) {
    const int x = kGapPx + static_cast<int>(i) * (width + kGapPx);
    DrawText(FittingText(columns[i].name, kTextPx, width), x, kGapPx, kTextPx, kInk, &canvas);
    for (size_t k = 0; k < rows.size(); ++k) {
      const int y = kLinePx + static_cast<int>(k) * (kLinePx + height);
      if (i == 0) DrawText(rows[k].title, x, y + kGapPx, kTextPx, kInk, &canvas);
      DrawPicture(Resize(rows[k].pictures[i], width, height), x, y + kLinePx, 1.0f, &canvas);
    }
  }
  return canvas;
}

std::string ExplainMarkdown(const ExplainFacts& facts, const std::vector<ModelStudy>& studies) {
  std::string text = fmt::format(
      "# Why the colorizer is consistent: {}\n\nKey view {}; {} views, {} pairs of views with "
      "common surfaces; {}. The network alone, as in the paper: no carried colour, no neighbours. "
      "ΔE00 of grey: {:.2f}.\n\n![Principal components of the features](features.png)\n\n",
      facts.scene,
      facts.key_view,
      facts.views,
      facts.pairs,
      facts.encoder,
      facts.gray);
  return text + FeatureTable(facts, studies) + ConsistencyTable(studies) + BoundTable(studies);
}

nlohmann::ordered_json ExplainJson(const ExplainFacts& facts,
                                   const std::vector<ModelStudy>& studies) {
  nlohmann::ordered_json json{{"scene", facts.scene},
                              {"key_view", facts.key_view},
                              {"encoder", facts.encoder},
                              {"views", facts.views},
                              {"pairs", facts.pairs},
                              {"delta_e00_gray", facts.gray}};
  const auto distance = [](const FeatureDistance& d) {
    return nlohmann::ordered_json{
        {"places", d.places}, {"matched", d.matched}, {"unmatched", d.unmatched}};
  };
  for (const ModelStudy& study : studies) {
    nlohmann::ordered_json row{{"model", study.name},
                               {"lambda", study.lambda},
                               {"delta_e00", study.delta_e00},
                               {"variance_key", study.key_spread.variance},
                               {"variance_others", study.other_spread.variance},
                               {"chroma", study.other_spread.chroma},
                               {"color", distance(study.color)},
                               {"decoder", distance(study.decoder)}};
    for (const FeatureDistance& tap : study.taps) row["taps"].push_back(distance(tap));
    row["bound"] = {{"encoder_norm", study.norms.encoder},
                    {"encoder_ratio", study.bound.encoder_ratio},
                    {"decoder_norm", study.norms.decoder},
                    {"decoder_ratio", study.bound.decoder_ratio},
                    {"whole_norm", study.norms.whole},
                    {"residual", study.bound.residual},
                    {"equivariance", study.bound.equivariance},
                    {"points", study.bound.points},
                    {"color", study.bound.color},
                    {"largest_color", study.bound.largest_color},
                    {"bound", study.bound.bound},
                    {"holds", study.bound.holds}};
    json["models"].push_back(row);
  }
  return json;
}

}  // namespace color3d
