#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "core/catalogue/error_model.h"
#include "core/catalogue/metrics.h"
#include "core/catalogue/stages.h"
#include "core/image/codec.h"
#include "core/report/curves.h"
#include "core/report/report_page.h"
#include "core/report/run_curve.h"
#include "core/report/scene_plan.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/key_view_ranking.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/report/color_sections.h"
#include "core/stage/report/key_view_section.h"
#include "core/stage/report/repeat_section.h"
#include "core/stage/report/report_views.h"
#include "core/stage/run_stages.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;

constexpr int kReportSidePx = 540;

std::vector<std::string> KeysInOrder(const ordered_json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return InMetricOrder(std::move(keys));
}

// The means for each way in which views are held out, if there are several.
void AddByHeldOut(const ordered_json& scores, ordered_json* metrics) {
  if (!scores.contains("held_out") || scores.at("held_out").size() < 2) return;
  for (const auto& [how, means] : scores.at("held_out").items()) {
    (*metrics)[fmt::format("views_{}", how)] = means.at("views");
    for (const std::string& key : KeysInOrder(means)) {
      const Metric* metric = FindMetric(key).metric;
      if (key == "views" || (metric != nullptr && !metric->Is(Metric::kByHeldOut))) continue;
      (*metrics)[fmt::format("{}_{}", key, how)] = means.at(key);
    }
  }
}

// metrics.json, in the order in which it is read.
ordered_json CollectMetrics(const std::vector<StageSummary>& stages,
                            const std::vector<std::string>& keys,
                            const std::optional<NextKeyViewFacts>& next,
                            const ColorFacts& colors,
                            const std::optional<SceneMotion>& motion,
                            StageContext& context) {
  ordered_json metrics = ordered_json::object();
  if (context.HasInput(artifact::kScores)) {
    const auto scores = ReadJson(context, artifact::kScores);
    const auto& mean = scores.at("mean");
    for (const std::string& key : KeysInOrder(mean)) metrics[key] = mean.at(key);
    if (scores.contains("interval_95")) metrics["interval_95"] = scores.at("interval_95");
    AddByHeldOut(scores, &metrics);
  }
  metrics["key_views"] = keys;
  if (next) {
    metrics["next_key_view"] = next->name;
    metrics["expected_error_now"] = next->error_now;
    metrics["expected_error_with_next"] = next->error_with;
  }
  metrics["augmentations"] = colors.augmentations();
  for (const auto& [name, value] : colors.Metrics()) metrics[name] = value;
  if (context.HasInput(artifact::kExportScores)) {
    const auto scores = ReadJson(context, artifact::kExportScores);
    for (const auto& [format, values] : scores.items()) {
      metrics[format + "_psnr_db_vs_lab"] = values.at("psnr_db_vs_lab");
      metrics[format + "_worst_psnr_db_vs_lab"] = values.at("worst_psnr_db_vs_lab");
    }
  }
  if (context.HasInput(artifact::kModel)) {
    const size_t count = ParseGaussians(context.ReadInput(artifact::kModel)).size();
    if (count > 0) metrics["gaussians"] = count;
  }
  if (motion && !MotionClass(*motion).empty()) metrics["motion"] = MotionClass(*motion);
  if (motion && motion->share) metrics["moving_share"] = *motion->share;
  double total = 0.0;
  int64_t peak = 0;
  for (const StageSummary& s : stages) {
    total += s.seconds;
    peak = std::max(peak, s.peak_memory_bytes);
  }
  metrics["seconds_total"] = total;
  for (const StageSummary& s : stages) {
    if (s.state != "SUCCEEDED") continue;
    const std::string name = "seconds_" + s.kind;
    metrics[name] = metrics.value(name, 0.0) + s.seconds;  // key views are several jobs of one kind
  }
  if (peak > 0) metrics["peak_memory_bytes"] = peak;
  return metrics;
}

std::vector<CurvePoint> CollectCurves(const StageContext& context) {
  std::vector<CurvePoint> curves;
  for (const std::string& name : context.InputsBelow(artifact::kCurves)) {
    const auto points = CurvesFromCsv(context.ReadInput(name));
    curves.insert(curves.end(), points.begin(), points.end());
  }
  return curves;
}

RunCurve CollectRunCurve(const std::vector<StageSummary>& stages,
                         const std::vector<CurvePoint>& curves) {
  std::vector<RanStage> ran;
  for (const StageSummary& s : stages) {
    if (s.state == "SUCCEEDED") ran.push_back({s.kind, s.seconds});
  }
  return EstimateRunCurve(ran, curves);
}

// Facts of the plan that follow from the scene's kind.
PlanFacts FactsOfKind(const Scene& scene, const StageContext& context) {
  const CaptureKindInfo& capture = ColoredAs(context, scene);
  PlanFacts facts{.kind = capture.kind};
  if (!capture.is_dynamic) return facts;
  std::set<int> cameras;
  for (const View& view : scene.views) cameras.insert(view.moment->shot);
  facts.time_steps = static_cast<int>(scene.Times().size());
  facts.cameras = static_cast<int>(cameras.size());
  return facts;
}

// nullopt without times, and without geometry.
std::optional<SceneMotion> MotionOf(const PlanFacts& facts,
                                    const std::vector<CurvePoint>& curves,
                                    const StageContext& context) {
  const char* name = context.HasInput(artifact::kModel) ? artifact::kModel : artifact::kGeometry;
  if (facts.time_steps == 0 || !context.HasInput(name)) return std::nullopt;
  SceneMotion motion;
  motion.moves = ParseGaussians(context.ReadInput(name)).IsDynamic();
  for (const CurvePoint& point : curves) {
    if (point.stage == kind::kReconstructGeometry && point.error_name == "moving_share") {
      motion.share = point.value;
    }
  }
  return motion;
}

// Negative if no stage of the kind has run.
double SecondsOf(const std::vector<StageSummary>& stages, const std::string& kind) {
  double seconds = -1.0;
  for (const StageSummary& s : stages) {
    if (s.kind == kind && s.state == "SUCCEEDED") seconds = std::max(seconds, 0.0) + s.seconds;
  }
  return seconds;
}

// By the plan of the server; negative if it is unknown, as in benchmarks without a server.
double ExpectedSecondsOf(const std::vector<StageSummary>& stages, const std::string& kind) {
  double seconds = -1.0;
  for (const StageSummary& s : stages) {
    if (s.kind == kind && s.expected_seconds >= 0.0) {
      seconds = std::max(seconds, 0.0) + s.expected_seconds;
    }
  }
  return seconds;
}

// Maxima over the stages of the kind; 0 where unknown.
struct StageMemory {
  int64_t expected_bytes = 0;
  int64_t measured_bytes = 0;
};

StageMemory MemoryOf(const std::vector<StageSummary>& stages, const std::string& kind) {
  StageMemory memory;
  for (const StageSummary& s : stages) {
    if (s.kind != kind) continue;
    memory.expected_bytes = std::max(memory.expected_bytes, s.expected_peak_memory_bytes);
    memory.measured_bytes = std::max(memory.measured_bytes, s.peak_memory_bytes);
  }
  return memory;
}

std::string DescribeMotion(const FilmFindings& film, const Scene& scene) {
  std::string text = scene.relief       ? "the camera stands still, so that depth is unknown"
                     : film.poses_found ? fmt::format("{} frames have poses", film.frames_placed)
                     : film.camera_stands_still ? "the camera stands still"
                                                : "no poses were found";
  if (film.motion_energy >= 0.0) {
    text += fmt::format("; {:.1f} % of the picture is moving objects", 100.0 * film.motion_energy);
  }
  return text;
}

std::vector<PlanStep> CollectPlan(const Scene& scene,
                                  PlanFacts plan_facts,
                                  const std::vector<StageSummary>& stages,
                                  const StageContext& context) {
  if (!context.HasInput(artifact::kImportFacts))
    return {};  // the facts that the plan depends on are unknown
  const ImportFacts facts = ImportFactsFromJson(context.ReadInput(artifact::kImportFacts));
  plan_facts.has_poses = !facts.ran_structure_from_motion;
  plan_facts.geometry_given = context.HasInput(artifact::kGivenGeometry);
  plan_facts.has_distortion = facts.undistorted;
  plan_facts.has_sparse_points = !facts.random_points;
  plan_facts.has_augmentations = context.HasInput(artifact::kAugmentationFacts);
  plan_facts.has_corrections = context.HasInput(artifact::kCorrections);
  if (context.HasInput(artifact::kKeyView)) {
    const std::string strategy = ReadJson(context, artifact::kKeyView).at("strategy");
    plan_facts.key_view_given = strategy == "manual";
    plan_facts.key_view_strategy = StrategyInWords(strategy);
  }
  plan_facts.views = static_cast<int>(scene.views.size());
  const Camera camera = scene.views.at(0).camera.FitWithin(kReportSidePx);
  plan_facts.megapixels_per_view = 1e-6 * camera.width * camera.height;
  std::vector<PlanStep> plan = PlanScene(plan_facts);
  for (const StageSummary& s : stages) {
    if (s.state == "SKIPPED") SkipStep(s.kind, s.skip_reason, &plan);
  }
  for (PlanStep& step : plan) {
    if (step.stage.empty()) continue;
    const double expected = ExpectedSecondsOf(stages, step.stage);
    const bool skipped = std::ranges::any_of(stages, [&](const StageSummary& s) {
      return s.kind == step.stage && s.state == "SKIPPED";
    });
    // Other stages that are not needed ran without their main work, e.g. import with given poses.
    const StageMemory memory = MemoryOf(stages, step.stage);
    if (expected >= 0.0 && (step.needed || skipped)) {
      step.estimated_seconds = expected;
      step.estimated_memory_bytes = memory.expected_bytes;
    }
    if (step.needed) {
      step.measured_seconds = SecondsOf(stages, step.stage);
      step.measured_memory_bytes = memory.measured_bytes;
    }
  }
  const auto add_reason = [&plan](const char* stage, const std::string& note) {
    for (PlanStep& step : plan) {
      if (step.stage == stage && !note.empty()) step.reason += "; " + note;
    }
  };
  add_reason(kind::kImportScene, facts.sfm_plan);
  if (facts.film) add_reason(kind::kImportScene, DescribeMotion(*facts.film, scene));
  if (scene.relief) {
    add_reason(kind::kReconstructGeometry,
               "2.5D: depth is assumed, ground in front of an upright backdrop");
  }
  if (context.HasInput(artifact::kMemoryPlan)) {
    const auto memory = ReadJson(context, artifact::kMemoryPlan);
    add_reason(kind::kReconstructGeometry, memory.at("note"));
  }
  if (context.HasInput(artifact::kAugmentationFacts)) {
    const auto facts = ReadJson(context, artifact::kAugmentationFacts);
    for (const auto& left_out : facts.at("left_out")) {
      plan.push_back({.step = "augmentation_" + left_out.at("kind").get<std::string>(),
                      .needed = false,
                      .reason = left_out.at("reason")});
    }
  }
  return plan;
}

std::string Summary(const Scene& scene,
                    const PlanFacts& facts,
                    const ordered_json& metrics,
                    const std::vector<std::string>& keys) {
  const int gaussians = metrics.value("gaussians", 0);
  const std::string result = gaussians > 0 ? fmt::format("{} Gaussians", gaussians) : "Coloured";
  return fmt::format("{} {}{} ({} held out){}. {} in {} s of computing.",
                     scene.views.size(),
                     scene.HasTimes() && gaussians == 0 ? "frames" : "views",
                     facts.time_steps > 0 ? fmt::format(" of {} times", facts.time_steps) : "",
                     scene.HeldOutViews().size(),
                     keys.empty() ? std::string()
                                  : fmt::format(", all colours from the key {} {}",
                                                keys.size() == 1 ? "view" : "views",
                                                fmt::join(keys, ", ")),
                     result,
                     static_cast<int>(metrics.value("seconds_total", 0.0) + 0.5));
}

// " (95 % interval over views: 3.10 to 4.20)" for metrics with a confidence interval, else "".
std::string IntervalText(const ordered_json& metrics, const char* key) {
  const auto intervals = metrics.find("interval_95");
  if (intervals == metrics.end() || !intervals->contains(key)) return "";
  const ordered_json& interval = intervals->at(key);
  return fmt::format(" (95 % interval over views: {} to {})",
                     MetricText(key, interval.at(0).get<double>()),
                     MetricText(key, interval.at(1).get<double>()));
}

// The most important metrics, in words.
std::vector<std::pair<std::string, std::string>> Headline(const ordered_json& metrics) {
  std::vector<std::pair<std::string, std::string>> headline;
  for (const Metric& metric : MetricCatalogue()) {
    const auto found = metrics.find(metric.key);
    if (!metric.Is(Metric::kInHeadline) || found == metrics.end() || !found->is_number()) continue;
    headline.emplace_back(
        metric.label,
        MetricText(metric.key, found->get<double>()) + IntervalText(metrics, metric.key));
  }
  return headline;
}

// The pictures of the key view that there are.
ReportRow KeyPictures(const std::string& title, const StageContext& context) {
  ReportRow row{title, {}};
  for (const auto& [name, caption] :
       {std::pair{artifact::kKeyViewGray, "as captured"},
        {artifact::kKeyViewColored, "coloured: all colours of the scene come from here"}}) {
    if (!context.HasInput(name)) continue;
    row.pictures.push_back(SmallPicture(ReadPicture(context, name), caption, kReportSidePx));
  }
  return row;
}

void ForwardResults(StageContext& context) {
  for (const Stage& stage : StageCatalogue()) {
    for (const char* result : stage.results) {
      if (context.HasInput(result)) context.ForwardInput(result);
      if (!std::string_view(result).ends_with('/')) continue;
      for (const std::string& name : context.InputsBelow(result)) context.ForwardInput(name);
    }
  }
}

}  // namespace

void RunReport(const std::vector<StageSummary>& stages, StageContext& context) {
  const Scene scene = ReadScene(context);
  std::optional<int> key;
  if (context.HasInput(artifact::kKeyView)) key = ReadKeyView(context, scene);
  std::vector<std::string> keys = ReadCarryFacts(context).key_views;
  if (keys.empty() && key) {
    keys = AdditionalKeyViewNames(context);
    keys.insert(keys.begin(), scene.views[*key].name);
  }
  const std::vector<CurvePoint> curves = CollectCurves(context);
  const RunCurve run_curve = CollectRunCurve(stages, curves);
  auto next = keys.empty() ? std::nullopt : AdviseNextKeyView(scene, keys, context);
  if (next && !run_curve.points.empty()) {
    const double error = run_curve.points.back().error;
    next->error_with = ErrorWithNextKeyView(error, next->error_with / next->error_now);
    next->error_now = error;
  }
  const ColorFacts colors(scene, context, next);
  PlanFacts facts = FactsOfKind(scene, context);
  facts.motion = MotionOf(facts, curves, context);
  ordered_json metrics = CollectMetrics(stages, keys, next, colors, facts.motion, context);
  if (scene.HasTimes() && !scene.views.empty()) {
    metrics["seconds_per_frame"] =
        metrics.at("seconds_total").get<double>() / static_cast<double>(scene.views.size());
  }
  facts.has_truth = metrics.contains("delta_e00");

  ReportData data;
  data.title = fmt::format("Color3D: {} views in colour", scene.views.size());
  data.summary = Summary(scene, facts, metrics, keys);
  if (context.HasInput(artifact::kViewPage)) data.view_page = artifact::kViewPage;
  data.key_view = KeyViewChapter(KeyPictures(key ? scene.views[*key].name : "", context), context);
  data.additional_key_views = AdditionalKeyViewChapters(scene, kReportSidePx, context);
  std::vector<CurvePoint> personalization;
  std::ranges::partition_copy(curves,
                              std::back_inserter(personalization),
                              std::back_inserter(data.curves),
                              [](const CurvePoint& p) { return p.stage == kind::kPersonalize; });
  facts.untrained_decoder = FindUntrainedDecoder(personalization);
  data.sections = colors.Sections(std::move(personalization));
  data.run_curve = RunCurvePlot(run_curve);
  data.views = ReportViews(scene, context);
  data.headline = Headline(metrics);
  for (const auto& [name, value] : metrics.items()) {
    if (value.is_number()) data.metrics.emplace_back(name, value.get<double>());
  }
  data.plan = CollectPlan(scene, facts, stages, context);
  for (const StageSummary& s : stages) {
    if (s.state == "SUCCEEDED") data.stages.push_back({s.kind, s.seconds});
    for (const std::string& w : s.warnings) data.warnings.push_back(s.kind + ": " + w);
  }
  AddHowToRepeat(keys, facts.has_truth, context, &data);
  context.WriteOutput(artifact::kMetrics, metrics.dump(1) + "\n");
  std::vector<CurvePoint> all_curves = RunCurvePoints(run_curve);
  all_curves.insert(all_curves.end(), curves.begin(), curves.end());
  context.WriteOutput(artifact::kAllCurves, CurvesToCsv(all_curves));
  context.WriteOutput(artifact::kPlan, PlanToJson(data.plan));
  context.WriteOutput(artifact::kReport, RenderReport(data));
  ForwardResults(context);
}

}  // namespace color3d
