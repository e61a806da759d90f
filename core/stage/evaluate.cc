#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/catalogue/error_model.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/metrics/confidence_interval.h"
#include "core/metrics/scene_consistency.h"
#include "core/metrics/view_scores.h"
#include "core/scene/import/hold_out.h"
#include "core/scene/photo_masks.h"
#include "core/scene/view_images.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/stage/film/film_writer.h"
#include "core/stage/film/temporal_scores.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/chroma_budget.h"
#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;
using TruthFiles = std::map<int, std::filesystem::path>;  // by view

TruthFiles FilesByView(const std::vector<TruthFile>& truth, bool held_out, const Scene& scene) {
  TruthFiles files;
  for (const TruthFile& file : truth) {
    const int index = scene.FindView(file.view);
    if (scene.views[index].held_out != held_out) {
      throw InvalidArgument(
          "truth was given for {}, which is a {}",
          scene.views[index].name,
          held_out ? "training view; only held-out views are scored"
                   : "held-out view; only training views bound what a reconstruction can reach");
    }
    files[index] = file.file;
  }
  return files;
}

// Passes on progress but no errors, because the curves of the bound would mix with those of the
// chroma of the scene.
class WithoutCurves : public ProgressObserver {
 public:
  explicit WithoutCurves(ProgressObserver& outer) : outer_(outer) {}
  void OnProgress(int64_t step, int64_t total, const std::string& message) override {
    outer_.OnProgress(step, total, "bound: " + message);
  }
  void OnError(int64_t, const std::string&, double) override {}
  void OnWarning(const std::string& message) override { outer_.OnWarning("bound: " + message); }

 private:
  ProgressObserver& outer_;
};

// Fits the true colours of the training views on the same geometry. Throws Error{kInvalidArgument}
// with the name of a training view without truth.
GaussianModel FitTrueChroma(const GaussianModel& geometry,
                            const Scene& scene,
                            const TruthFiles& truth,
                            const ChromaOptions& options,
                            StageContext& context) {
  const std::vector<int> training = scene.TrainingViews();
  for (const int view : training) {
    if (truth.contains(view)) continue;
    throw InvalidArgument(
        "the bound needs the true colours of every training view; those of {} are missing",
        scene.views[view].name);
  }
  const int side = ColoredSide(context, scene.views[training.at(0)]);
  const ViewImages images(scene, context.scene_folder(), side, 0);
  const ChromaTargetSource targets = [&](int view) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = ChromaOfLab(LabFromSrgb(images.UndistortFile(view, truth.at(view))));
    if (const auto mask = images.Mask(view)) target->weight = *mask;
    return target;
  };
  WithoutCurves progress(context.progress());
  NoCheckpoints none;
  return FitChroma(geometry,
                   ChromaProblemOf(scene, images, targets),
                   ChromaWithinMemory(options, scene, geometry, context.MemoryBytes()),
                   {context.pool(), none, progress, context.cancel()});
}

// Sizes of the groups of views to compare, in the order of time: the cameras of each time, because
// objects move in between. For photos and for a single camera, one group of all views.
std::vector<int> GroupsToCompare(const Scene& scene) {
  std::map<double, int> moments;
  for (const View& view : scene.views) ++moments[view.time_s()];
  std::vector<int> groups;
  for (const auto& [time_s, views] : moments) groups.push_back(views);
  if (groups.size() < scene.views.size()) return groups;
  return {static_cast<int>(scene.views.size())};
}

SceneConsistency CompareViews(const Scene& scene,
                              const GaussianModel& model,
                              const TruthFiles& truth,
                              StageContext& context) {
  const ViewImages images(scene, context.scene_folder(), kConsistencySidePx, 0);
  ConsistencySource source;
  source.groups = GroupsToCompare(scene);
  const std::vector<int> order = scene.ViewsInOrderOfTime();
  source.render = [&](int number) {
    const int view = order[number];
    const Pose& pose = scene.views[view].cam_from_world;
    const Camera camera = images.WorkingCamera(view);
    RenderedView rendered = RenderView(model, scene.views[view], camera, context.pool());
    ClearMasked(images.Mask(view).get(), &rendered.depth);  // no matches there
    return ConsistencySource::Rendered{{camera, pose, std::move(rendered.depth)},
                                       std::move(rendered.lab)};
  };
  source.colored_lab = [&](int number) {
    const int view = order[number];
    const auto luminance = images.Luminance(view);
    return JoinLab(*luminance,
                   ReadViewAb(context, scene.views[view], luminance->width, luminance->height));
  };
  source.has_truth = [&](int number) { return truth.contains(order[number]); };
  source.true_srgb = [&](int number) {
    return images.UndistortFile(order[number], truth.at(order[number]));
  };
  return MeasureConsistency(source, context.pool(), context.cancel());
}

// Scores of the held-out views that have a truth.
class HeldOutScores {
 public:
  // Without a model, the coloured frames are scored in place of renders.
  HeldOutScores(const Scene& scene,
                const std::optional<GaussianModel>& model,
                const std::optional<GaussianModel>& bound,
                StageContext& context)
      : scene_(scene), how_(HeldOutKinds(scene)), model_(model), bound_(bound), context_(context) {}

  void Add(int index, const std::filesystem::path& truth) {
    const View& view = scene_.views[index];
    const std::string ab_name = ViewAbArtifact(context_, view);
    const Image ab = ReadAbMap(context_, ab_name).ab;
    const ViewImages images(scene_, context_.scene_folder(), std::max(ab.width, ab.height), 0);
    const Image true_srgb = images.UndistortFile(index, truth);
    if (true_srgb.channels != 3)
      throw InvalidArgument("the truth of {} is grey; give the photo in colour", view.name);
    const Camera camera = images.WorkingCamera(index);
    const Image delivered = model_ ? Rendered(*model_, camera, view)
                                   : ColoredFrame(view, index, /*is_key=*/false, images, context_);
    const auto mask = images.Mask(index);
    Scores scores = ScoreView(true_srgb, delivered, ab, mask.get());
    if (scores.empty()) {
      context_.Warn(view.name + " is not scored: no pixel of it is unmasked");
      return;
    }
    if (bound_) {
      const Image lab = Rendered(*bound_, camera, view);
      scores["delta_e00_chroma_bound"] = ChromaError(true_srgb, lab, mask.get());
      scores["colorfulness_bound"] =
          MaskedColorfulness(SrgbFromLab(lab, context_.pool()), mask.get());
    }
    const std::string provenance = ProvenanceArtifact(context_, view);
    if (context_.HasInput(provenance)) {
      sources_.Add(true_srgb, ab, ReadPicture(context_, provenance), mask.get());
    }
    ordered_json entry{{"view", view.name}};
    const std::string how = NameOf(how_[index]);
    if (!how.empty()) entry["held_out"] = how;
    for (const auto& [name, value] : scores) entry[name] = value;
    views_.push_back(std::move(entry));
    all_.Add(scores);
    for (const auto& [name, value] : scores) values_[name].push_back(value);
    if (!how.empty()) by_how_[how].Add(scores);
    const Image colored = SrgbFromLab(JoinLab(LuminanceOfLab(LabFromSrgb(true_srgb)),
                                              Resize(ab, true_srgb.width, true_srgb.height)));
    context_.WriteOutput(ViewArtifact(artifact::kTruths, view, ".jpg"), EncodeJpeg(true_srgb));
    context_.WriteOutput(ViewArtifact(artifact::kColored2d, view, ".jpg"), EncodeJpeg(colored));
  }

  // Empty if no view was added.
  Scores Mean() const { return MeanOf(all_); }
  // Means for each way in which views are held out; empty for photos.
  ordered_json MeansByHoldOutKind() const {
    ordered_json json = ordered_json::object();
    for (const auto& [how, sum] : by_how_) {
      json[how] = {{"views", sum.views}};
      for (const auto& [name, value] : MeanOf(sum)) json[how][name] = value;
    }
    return json;
  }
  // 95 % confidence interval of each mean over the views; empty for fewer than two views.
  ordered_json Intervals() const {
    ordered_json json = ordered_json::object();
    if (all_.views < 2) return json;
    for (const auto& [name, values] : values_) {
      const MeanWithInterval interval = BootstrapMean(values);
      json[name] = {interval.low, interval.high};
    }
    return json;
  }
  const ordered_json& views() const { return views_; }
  const SourceErrors& sources() const { return sources_; }

 private:
  struct Sum {
    int views = 0;
    Scores scores;
    void Add(const Scores& more) {
      ++views;
      for (const auto& [name, value] : more) scores[name] += value;
    }
  };

  Scores MeanOf(const Sum& sum) const {
    Scores mean;
    for (const auto& [name, value] : sum.scores) mean[name] = value / sum.views;
    const double truth = mean.contains("colorfulness_truth") ? mean["colorfulness_truth"] : 0.0;
    if (truth > 0.0) {
      mean["colorfulness_ratio"] = mean["colorfulness"] / truth;
      mean["colorfulness_ratio_2d"] = mean["colorfulness_2d"] / truth;
      if (bound_) mean["colorfulness_ratio_bound"] = mean["colorfulness_bound"] / truth;
    }
    return mean;
  }

  Image Rendered(const GaussianModel& model, const Camera& camera, const View& view) {
    return RenderView(model, view, camera, context_.pool()).lab;
  }

  const Scene& scene_;
  const std::vector<HoldOutKind> how_;  // by view
  const std::optional<GaussianModel>& model_;
  const std::optional<GaussianModel>& bound_;
  StageContext& context_;
  ordered_json views_ = ordered_json::array();
  Sum all_;
  std::map<std::string, std::vector<double>> values_;  // of the views, by metric
  std::map<std::string, Sum> by_how_;
  SourceErrors sources_;
};

// `common`: the same pictures on common matches, or nullptr.
ordered_json JsonOf(const Consistency& c, const Consistency* common) {
  ordered_json json{{"pairs", c.pairs}, {"matches", c.matches}};
  for (const auto& [name, value] : c.Figures()) json[name] = value;
  if (common == nullptr || common->matches == 0) return json;
  json["matches_common"] = common->matches;
  for (const auto& [name, value] : common->Figures()) json[name + "_common"] = value;
  return json;
}

ordered_json JsonOf(const SceneConsistency& scores) {
  ordered_json json = ordered_json::object();
  if (scores.rendered.pairs > 0) {
    const SceneConsistency::Common* common = scores.common ? &*scores.common : nullptr;
    json["rendered"] = JsonOf(scores.rendered, common ? &common->rendered : nullptr);
    json["colored_views"] = JsonOf(scores.colored, common ? &common->colored : nullptr);
    if (scores.truth) json["truth"] = JsonOf(*scores.truth, common ? &*common->truth : nullptr);
  }
  return json;
}

}  // namespace

void EvaluateOptions::Validate() const {
  chroma.Validate();
  if (bound && (truth.empty() || training_truth.empty())) {
    throw InvalidArgument(
        "the bound needs true colours of held-out and of all training views; give both or leave "
        "the bound out");
  }
}

void RunEvaluate(const EvaluateOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const TruthFiles held_out = FilesByView(options.truth, true, scene);
  const TruthFiles training = FilesByView(options.training_truth, false, scene);
  std::optional<GaussianModel> model;
  if (ColoredAs(context, scene).is_reconstructed)
    model = ParseGaussians(context.ReadInput(artifact::kModel));
  std::optional<GaussianModel> bound;
  if (options.bound && model) {
    bound = FitTrueChroma(*model, scene, training, options.chroma, context);
  }
  HeldOutScores scores(scene, model, bound, context);
  int64_t done = 0;
  for (const auto& [view, file] : held_out) {
    context.ThrowIfCancelled();
    scores.Add(view, file);
    context.ReportProgress(++done, std::ssize(held_out), "scoring " + scene.views[view].name);
  }
  TruthFiles all = held_out;
  all.insert(training.begin(), training.end());
  SceneConsistency consistency;
  if (model) consistency = CompareViews(scene, *model, all, context);
  const Scores mean = scores.Mean();
  // The error that users look for is last, so that it stays in the progress of the job.
  for (const auto& [name, value] : mean) {
    if (name != kScoreCurve) context.progress().OnError(0, name, value);
  }
  if (const auto score = mean.find(kScoreCurve); score != mean.end()) {
    context.progress().OnError(0, kScoreCurve, score->second);
  }
  ordered_json json{{"mean", mean}, {"views", scores.views()}};
  if (ordered_json intervals = scores.Intervals(); !intervals.empty()) {
    json["interval_95"] = std::move(intervals);
  }
  if (ordered_json by_how = scores.MeansByHoldOutKind(); !by_how.empty()) {
    json["held_out"] = std::move(by_how);
  }
  json["consistency"] = JsonOf(consistency);
  if (ordered_json temporal = TemporalScores(scene, model, bound, all, context);
      !temporal.empty()) {
    json["temporal"] = std::move(temporal);
  }
  if (!scores.sources().Empty()) json["sources"] = scores.sources().Result();
  context.WriteOutput(artifact::kScores, json.dump(1) + "\n");
}

}  // namespace color3d
