#include "core/stage/report/color_sections.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "core/carry/confidence.h"
#include "core/catalogue/metrics.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/json_artifact.h"
#include "core/stage/report/key_view_section.h"
#include "core/stage/report/source_overlay.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;

constexpr int kPictureSidePx = 400;
constexpr size_t kMaxRows = 20;  // of a table
constexpr size_t kMaxPictures =
    4;  // views shown with their provenance, from the least to the most certain

std::string Percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

// Names of the sources by ProvenancePlane.
constexpr const char* kSourceNames[] = {"guessed", "seen", "inferred"};
constexpr ProvenancePlane kMostCertainFirst[] = {kSeenPlane, kInferredPlane, kGuessedPlane};

SourceShares SharesOf(const Image& provenance) {
  SourceShares shares;
  double total = 0.0;
  for (int c = 0; c < kProvenancePlanes; ++c) {
    const float* plane = provenance.Plane(c);
    shares[c] = std::accumulate(plane, plane + provenance.PlaneSize(), 0.0);
    total += shares[c];
  }
  if (!(total > 0.0)) return {1.0, 0.0, 0.0};
  for (double& share : shares) share /= total;
  return shares;
}

// Percentages of seen, inferred and guessed colour.
std::vector<std::string> Percentages(const SourceShares& shares) {
  std::vector<std::string> texts;
  for (const ProvenancePlane plane : kMostCertainFirst) texts.push_back(Percent(shares[plane]));
  return texts;
}

std::vector<std::string> KeysOf(const std::map<std::string, double>& figures) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : figures) keys.push_back(key);
  return keys;
}

}  // namespace

ColorFacts::ColorFacts(const Scene& scene,
                       StageContext& context,
                       std::optional<NextKeyViewFacts> next)
    : scene_(scene), context_(context), carry_(ReadCarryFacts(context)), next_(std::move(next)) {
  ReadProvenance();
  if (context.HasInput(artifact::kScores)) ReadScores();
  if (context.HasInput(artifact::kAugmentationFacts)) ReadAugmentations();
}

void ColorFacts::ReadProvenance() {
  for (size_t i = 0; i < scene_.views.size(); ++i) {
    const std::string name = ProvenanceArtifact(context_, scene_.views[i]);
    if (!context_.HasInput(name)) continue;
    const Image image = ReadPicture(context_, name);
    if (image.channels != 3) throw InvalidArgument("{} is grey; it must be RGB", name);
    const bool scored = context_.HasInput(ViewArtifact(artifact::kTruths, scene_.views[i], ".jpg"));
    views_.push_back({static_cast<int>(i), scored, SharesOf(image)});
  }
}

// All 0 if there are no such views.
SourceShares ColorFacts::MeanShares(bool scored_only) const {
  SourceShares mean{};
  double count = 0.0;
  for (const ViewFacts& view : views_) {
    if (scored_only && !view.scored) continue;
    for (int c = 0; c < kProvenancePlanes; ++c) mean[c] += view.shares[c];
    count += 1.0;
  }
  for (double& share : mean) share /= std::max(count, 1.0);
  return mean;
}

void ColorFacts::ReadAugmentations() {
  ParseArtifact(context_, artifact::kAugmentationFacts, [&](const ordered_json& facts) {
    for (const auto& sample : facts.at("samples")) {
      const std::string source = sample.at("source");
      augmentations_.push_back(
          sample.at("kind") == "file"
              ? source
              : fmt::format("{} ({})", sample.at("name").get<std::string>(), source));
    }
  });
}

void ColorFacts::AddRows(const ordered_json& found, std::vector<Agreement>* rows) {
  const std::pair<const char*, const char*> pictures[] = {
      {"rendered", "rendered from the 3D scene"},
      {"colored_views", "the photos in colour"},
      {"bound", "the same 3D scene under all true colours"},
      {"truth", "the true colours"}};
  for (const auto& [name, label] : pictures) {
    if (!found.contains(name)) continue;
    rows->push_back({name, label, found.at(name).get<std::map<std::string, double>>()});
  }
}

void ColorFacts::ReadScores() {
  ParseArtifact(context_, artifact::kScores, [&](const ordered_json& scores) {
    AddRows(scores.value("consistency", ordered_json::object()), &agreement_);
    AddRows(scores.value("temporal", ordered_json::object()), &steadiness_);
    errors_by_source_ = scores.value("sources", errors_by_source_);
  });
}

std::vector<std::pair<std::string, double>> ColorFacts::Metrics() const {
  std::vector<std::pair<std::string, double>> metrics;
  if (carry_.coverage) metrics.emplace_back("coverage", *carry_.coverage);
  const auto add_shares = [&](bool scored_only, const char* suffix) {
    const SourceShares mean = MeanShares(scored_only);
    for (const ProvenancePlane plane : kMostCertainFirst) {
      metrics.emplace_back(fmt::format("share_{}{}", kSourceNames[plane], suffix), mean[plane]);
    }
  };
  if (!views_.empty()) add_shares(/*scored_only=*/false, "");
  if (std::ranges::any_of(views_, &ViewFacts::scored)) add_shares(/*scored_only=*/true, "_scored");
  for (const auto& [name, value] : errors_by_source_) {
    if (!name.starts_with("share_")) metrics.emplace_back(name, value);
  }
  // The delivered pictures have no suffix: for films without a model, the coloured frames.
  const auto add = [&metrics](MetricTable table, const std::vector<Agreement>& rows) {
    for (const Agreement& row : rows) {
      const char* suffix = row.pictures == "truth"                 ? "_truth"
                           : row.pictures == "bound"               ? "_bound"
                           : row.pictures == rows.front().pictures ? ""
                                                                   : "_2d";
      for (const std::string& key : ColumnsOf(table, KeysOf(row.figures))) {
        const Metric* metric = FindMetric(key).metric;
        if (metric == nullptr || metric->Is(Metric::kInMetrics)) {
          metrics.emplace_back(key + suffix, row.figures.at(key));
        }
      }
    }
  };
  add(MetricTable::kAgreement, agreement_);
  add(MetricTable::kSteadiness, steadiness_);
  return metrics;
}

std::string ColorFacts::SourceSummary() const {
  std::string summary;
  const auto percentages = [&](bool scored_only) { return Percentages(MeanShares(scored_only)); };
  if (!views_.empty()) {
    const auto all = percentages(/*scored_only=*/false);
    summary = fmt::format(
        "{} of all pixels show a surface that a key view shows, {} resemble something in it, and "
        "{} are guessed. ",
        all[0],
        all[1],
        all[2]);
  }
  const auto scored = std::ranges::count_if(views_, &ViewFacts::scored);
  if (scored > 0) {
    const auto of_scored = percentages(/*scored_only=*/true);
    summary += fmt::format("In the {} scored views these are {}, {} and {}. ",
                           scored,
                           of_scored[0],
                           of_scored[1],
                           of_scored[2]);
  }
  if (carry_.coverage) {
    summary += fmt::format("The key {} {} of the other views' pixels.",
                           carry_.key_views.size() == 1 ? "view covers" : "views cover",
                           Percent(*carry_.coverage));
  }
  return summary;
}

std::vector<ColorFacts::ViewFacts> ColorFacts::LeastCertainFirst() const {
  std::vector<ViewFacts> views = views_;
  std::ranges::stable_sort(views, {}, [](const ViewFacts& view) {
    return view.shares[kSeenPlane] + 0.5 * view.shares[kInferredPlane];
  });
  return views;
}

ReportTable ColorFacts::ShareTable() const {
  const std::vector<ViewFacts> views = LeastCertainFirst();
  ReportTable table{{"view, least certain first", "seen", "inferred", "guessed"}, {}};
  for (size_t i = 0; i < std::min(views.size(), kMaxRows); ++i) {
    std::vector<std::string> cells = Percentages(views[i].shares);
    cells.insert(cells.begin(), scene_.views[views[i].view].name);
    table.rows.push_back(std::move(cells));
  }
  if (views.size() > kMaxRows) {
    table.rows.push_back({fmt::format("and {} more", views.size() - kMaxRows)});
  }
  return table;
}

ReportTable ColorFacts::ErrorTable() const {
  ReportTable table{{"held-out pixels", "share", "colour error, CIEDE2000"}, {}};
  for (const ProvenancePlane plane : kMostCertainFirst) {
    const std::string source = kSourceNames[plane];
    const auto share = errors_by_source_.find("share_" + source);
    const auto error = errors_by_source_.find("delta_e00_" + source);
    if (share == errors_by_source_.end() || error == errors_by_source_.end()) continue;
    table.rows.push_back({source, Percent(share->second), MetricText(error->first, error->second)});
  }
  return table;
}

std::vector<ReportRow> ColorFacts::ProvenanceRows() const {
  const std::vector<ViewFacts> views = LeastCertainFirst();
  const size_t wanted = std::min(views.size(), kMaxPictures);
  const ViewImages photos(scene_, context_.scene_folder(), kPictureSidePx, 0);
  std::vector<ReportRow> rows(wanted);
  context_.pool().ForEach(static_cast<int64_t>(wanted), [&](int64_t k, int) {
    const ViewFacts& facts = views[k * views.size() / wanted];
    const View& view = scene_.views[facts.view];
    ReportRow& row = rows[k];
    row.title = view.name;
    for (const std::string& name : {ViewArtifact(artifact::kColored2d, view, ".jpg"),
                                    ViewArtifact(artifact::kRenders, view)}) {
      if (!context_.HasInput(name)) continue;
      row.pictures.push_back(
          SmallPicture(ReadPicture(context_, name), "its colours", kPictureSidePx));
      break;
    }
    const std::string name = ProvenanceArtifact(context_, view);
    const auto shares = Percentages(facts.shares);
    row.pictures.push_back(
        SmallPicture(ShadeBySource(photos.Srgb(facts.view), ReadPicture(context_, name)),
                     fmt::format("where they come from: {} seen, {} inferred, {} guessed",
                                 shares[0],
                                 shares[1],
                                 shares[2]),
                     kPictureSidePx));
  });
  return rows;
}

ReportSection ColorFacts::SourceSection() const {
  ReportSection section;
  section.title = "Where the colour comes from";
  const std::string summary = SourceSummary();
  if (!summary.empty()) section.notes.push_back(summary);
  if (!augmentations_.empty()) {
    section.notes.push_back(fmt::format("Beside the key views, the colorizer was trained on {}.",
                                        fmt::join(augmentations_, ", ")));
  }
  if (next_) {
    section.notes.push_back(
        fmt::format("To see more of it in its own colours, colour {} next (--add-key-view): the "
                    "error (CIEDE2000) that is expected of all views falls from {:.1f} to {:.1f}.",
                    next_->name,
                    next_->error_now,
                    next_->error_with));
  }
  if (!views_.empty()) section.tables.push_back(ShareTable());
  if (!errors_by_source_.empty()) section.tables.push_back(ErrorTable());
  section.rows = ProvenanceRows();
  if (!section.rows.empty()) {
    const auto mean = Percentages(MeanShares(/*scored_only=*/false));
    section.legend = {
        {"seen", "seen in a key view: " + mean[0] + " (teal)"},
        {"inferred", "inferred, as it resembles something there: " + mean[1] + " (amber)"},
        {"guessed", "guessed: " + mean[2] + " (purple, hatched)"}};
  }
  return section;
}

ReportTable ColorFacts::TableOf(MetricTable which, const std::vector<Agreement>& rows) {
  std::map<std::string, double> all;
  for (const Agreement& row : rows) all.insert(row.figures.begin(), row.figures.end());
  const std::vector<std::string> keys = ColumnsOf(which, KeysOf(all));
  ReportTable table{{"pictures"}, {}};
  for (const std::string& key : keys) table.columns.push_back(MetricLabel(key));
  for (const Agreement& row : rows) {
    std::vector<std::string> cells = {row.label};
    for (const std::string& key : keys) {
      const auto figure = row.figures.find(key);
      cells.push_back(figure != row.figures.end() ? MetricText(key, figure->second) : "");
    }
    table.rows.push_back(std::move(cells));
  }
  return table;
}

ReportSection ColorFacts::AgreementSection() const {
  ReportSection section;
  section.title = "Do the views agree?";
  if (agreement_.empty()) return section;
  section.notes.push_back(
      "Differences between pictures where two views show the same surface. ME: mean difference of "
      "R, G, B (0 to 1), and in CIEDE2000. TC: mean squared difference between neighbouring views "
      "and between views 7 apart. Lower is better; the true colours differ, too, by gloss and "
      "exposure.");
  section.tables.push_back(TableOf(MetricTable::kAgreement, agreement_));
  return section;
}

ReportSection ColorFacts::SteadinessSection() const {
  ReportSection section;
  section.title = "Are the colours steady?";
  if (steadiness_.empty()) return section;
  section.notes.push_back(
      "From frame to frame. TC of chroma: mean change of a and b (Lab) along the optical flow, "
      "over "
      "the pixels that the flow follows there and back; faint colours change little, so compare it "
      "with the mean chroma. CDC: divergence of the colour histograms of frames 1, 2 and 4 apart, "
      "regardless of motion. Lower is better; true colours change, too.");
  section.tables.push_back(TableOf(MetricTable::kSteadiness, steadiness_));
  return section;
}

std::optional<UntrainedDecoder> FindUntrainedDecoder(
    const std::vector<CurvePoint>& personalization) {
  std::optional<UntrainedDecoder> decoder;
  for (const CurvePoint& point : personalization) {
    if (point.error_name == "train_l1_ab") return std::nullopt;
    if (point.error_name == kDecoderShareName) {
      decoder = {point.value, static_cast<int>(point.iteration)};
    }
  }
  return decoder;
}

namespace {

// Describes the curves of personalization; empty for fewer than two points of held-out error.
std::vector<std::string> NotesOnPersonalization(const std::vector<CurvePoint>& curves) {
  if (const auto decoder = FindUntrainedDecoder(curves)) {
    return {fmt::format(
        "Only the nearest neighbours give colours: they agree so well that a trained decoder would "
        "have {:.1f} % of the inferred colours, so it was not trained.",
        100.0 * decoder->share)};
  }
  std::vector<CurvePoint> errors;
  std::string stopped;
  for (const CurvePoint& point : curves) {
    if (point.error_name == "validation_delta_e00") errors.push_back(point);
    if (point.error_name == "stopped_early_iteration") {
      stopped =
          fmt::format(" Training ended at iteration {} because the error hardly fell any more.",
                      point.iteration);
    }
  }
  if (errors.size() < 2) return {};
  const CurvePoint &first = errors.front(), &last = errors.back();
  return {fmt::format(
      "The colour error (CIEDE2000) on augmentations of the key view that are kept out of training "
      "went from {:.1f} after {:.0f} s to {:.1f} after {:.0f} s.{}",
      first.value,
      first.seconds,
      last.value,
      last.seconds,
      stopped)};
}

}  // namespace

ReportSection ColorFacts::PersonalizationSection(std::vector<CurvePoint> curves) const {
  ReportSection section;
  section.title = "The personalized colorizer";
  section.notes = NotesOnPersonalization(curves);
  std::erase_if(curves, [](const CurvePoint& p) { return p.error_name == kDecoderShareName; });
  section.curves = std::move(curves);
  if (context_.HasInput(artifact::kAugmentationSheet)) {
    section.wide = {"training pictures beside the key view",
                    context_.ReadInput(artifact::kAugmentationSheet)};
  }
  return section;
}

std::vector<ReportSection> ColorFacts::Sections(std::vector<CurvePoint> personalization) const {
  std::vector<ReportSection> sections = {SourceSection(),
                                         AgreementSection(),
                                         SteadinessSection(),
                                         PersonalizationSection(std::move(personalization))};
  std::erase_if(sections, [](const ReportSection& section) {
    return section.notes.empty() && section.tables.empty() && section.curves.empty() &&
           section.wide.bytes.empty();
  });
  return sections;
}

}  // namespace color3d
