#include "server/worker/stage_runner.h"

#include "core/base/mutex.h"
#include "core/catalogue/stages.h"
#include "core/colorizer/scene_batch.h"
#include "core/report/curves.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/idle_stages.h"
#include "core/stage/run_stages.h"
#include "server/backends/grpc_colorizer.h"
#include "server/planning/key_view_jobs.h"
#include "server/planning/presets.h"
#include "server/planning/spec_check.h"
#include "server/store/job.h"
#include "server/worker/stage_options.h"

namespace color3d {
namespace {

using v1::JobSpec;

// File of a blob; empty if the spec names none.
std::filesystem::path FetchIf(bool present, const v1::Digest& digest, BlobSource& blobs) {
  return present ? blobs.Fetch(digest.sha256()) : std::filesystem::path();
}

ColorizeKeyViewOptions BackendOptionsFrom(const v1::KeyColorSource& source, BlobSource& blobs) {
  const v1::BackendInput& input = source.backend_input();
  ColorizeKeyViewOptions options;
  options.source = ColorizeKeyViewOptions::Source::kBackend;
  options.name = source.backend();
  options.prompt = input.prompt();
  options.file = FetchIf(input.has_points(), input.points(), blobs);
  options.mask = FetchIf(input.has_mask(), input.mask(), blobs);
  if (input.has_reference()) options.references = {blobs.Fetch(input.reference().sha256())};
  return options;
}

ColorizeKeyViewOptions SourceOptionsFrom(const v1::KeyColorSource& source, BlobSource& blobs) {
  using Source = ColorizeKeyViewOptions::Source;
  ColorizeKeyViewOptions options;
  options.name = source.model();
  switch (source.source_case()) {
    case v1::KeyColorSource::kImage:
      options.source = Source::kImage;
      options.file = blobs.Fetch(source.image().sha256());
      break;
    case v1::KeyColorSource::kStrokes:
      options.source = Source::kStrokes;
      options.file = blobs.Fetch(source.strokes().sha256());
      break;
    case v1::KeyColorSource::kPoints:
      options.source = Source::kPoints;
      options.file = blobs.Fetch(source.points().sha256());
      break;
    case v1::KeyColorSource::kReference:
      options.source = Source::kReferences;
      options.references = {blobs.Fetch(source.reference().sha256())};
      break;
    case v1::KeyColorSource::kReferences:
      options.source = Source::kReferences;
      for (const v1::Digest& image : source.references().images()) {
        options.references.push_back(blobs.Fetch(image.sha256()));
      }
      break;
    case v1::KeyColorSource::kPrompt:
      options.source = Source::kPrompt;
      options.prompt = source.prompt();
      break;
    case v1::KeyColorSource::kAutomatic:
      options.source = Source::kAutomatic;
      break;
    case v1::KeyColorSource::kBackend:
      return BackendOptionsFrom(source, blobs);
    case v1::KeyColorSource::kScript:
      options.source = Source::kScript;
      options.name = source.script();
      break;
    case v1::KeyColorSource::kEdit:
      options.source = Source::kEdit;
      options.file = blobs.Fetch(source.edit().image().sha256());
      options.mask = FetchIf(source.edit().has_mask(), source.edit().mask(), blobs);
      break;
    case v1::KeyColorSource::SOURCE_NOT_SET:
      throw InvalidArgument("the job does not say where the key view's colour comes from");
  }
  return options;
}

ColorizeKeyViewOptions KeyColorOptions(const v1::ColorizeKeyViewSpec& spec, BlobSource& blobs) {
  const v1::KeyColorSource& source = spec.source();
  ColorizeKeyViewOptions options = SourceOptionsFrom(source, blobs);
  options.above = FetchIf(HasPointsAbove(source), source.backend_input().points(), blobs);
  options.labels = FetchIf(source.has_labels(), source.labels(), blobs);
  options.hints = HintOptionsFrom(spec);
  options.view = spec.view();
  return options;
}

PaintedColors PaintedFrom(const v1::KeyColorSource& source, BlobSource& blobs) {
  using Kind = PaintedColors::Kind;
  switch (source.source_case()) {
    case v1::KeyColorSource::kStrokes:
      return {Kind::kStrokes, blobs.Fetch(source.strokes().sha256()), {}};
    case v1::KeyColorSource::kPoints:
      return {Kind::kPoints,
              blobs.Fetch(source.points().sha256()),
              FetchIf(source.has_labels(), source.labels(), blobs)};
    case v1::KeyColorSource::kImage:
      return {Kind::kPicture, blobs.Fetch(source.image().sha256()), {}};
    default:
      throw InvalidArgument(
          "a correction takes strokes, points or a picture, no other source of colour");
  }
}

CorrectColorsOptions CorrectOptions(const v1::CorrectColorsSpec& spec, BlobSource& blobs) {
  CorrectColorsOptions options = CorrectOptionsFrom(spec);
  for (const v1::FurtherKeyView& correction : spec.corrections()) {
    if (HasRange(correction)) continue;
    options.corrections.push_back({correction.view(), PaintedFrom(correction.color(), blobs)});
  }
  return options;
}

RenderOptions MovieOptions(const v1::RenderSpec& spec, BlobSource& blobs) {
  RenderOptions options = RenderOptionsFrom(spec);
  options.cameras = FetchIf(spec.has_cameras(), spec.cameras(), blobs);
  return options;
}

ColorizerOptions PersonalizeOptions(v1::PersonalizeSpec spec, const StageContext& context) {
  // As part of colorize_scene it has its size already.
  if (!ReadScene(context).capture().is_reconstructed) TrainAtFrameSize(kDefaultMaxSidePx, &spec);
  return ColorizerOptionsFrom(spec, context.seed());
}

void RunEvaluation(const v1::EvaluateSpec& spec, BlobSource& blobs, StageContext& context) {
  EvaluateOptions options;
  for (const v1::TruthImage& image : spec.truth()) {
    options.truth.push_back({image.view(), blobs.Fetch(image.image().sha256())});
  }
  for (const v1::TruthImage& image : spec.training_truth()) {
    options.training_truth.push_back({image.view(), blobs.Fetch(image.image().sha256())});
  }
  options.bound = spec.training_truth_size() > 0;
  RunEvaluate(options, context);
}

class CoreStageRunner : public StageRunner {
 public:
  StageOutput Run(const StageRun& run,
                  BlobSource& blobs,
                  CheckpointStore& checkpoints,
                  ProgressObserver& progress,
                  const CancellationToken& cancel) override {
    const std::string kind = KindOf(run.spec);
    CurveRecorder recorder(kind, progress, checkpoints);
    StageContext::Setup setup;
    setup.scene_folder = run.scene_folder;
    setup.inputs = run.inputs;
    setup.output_folder = run.output_folder;
    setup.scratch_folder = run.scratch_folder;
    setup.threads = run.threads;
    setup.seed = run.spec.seed() == 0 ? 1 : run.spec.seed();
    setup.cache_folder = run.cache_folder;
    setup.models = run.models.files;
    setup.remote_colorizers = [&run](const std::string& name) {
      GrpcColorizerOptions options;
      options.traceparent = run.traceparent;
      return MakeGrpcColorizer(run.models.backends, name, options);
    };
    setup.attempt = run.job_name + "/" + std::to_string(run.attempt);
    setup.batch = Batch(run.threads);
    setup.project = run.project;
    StageContext context(std::move(setup), recorder, recorder, cancel);
    if (SkipIdleStage(kind, context).empty()) RunStage(run, blobs, context);
    const auto points = recorder.points();
    if (!points.empty() && kind != kind::kColorizeScene) {
      context.WriteOutput(artifact::kCurves + kind + ".csv", CurvesToCsv(points));
    }
    return {context.outputs(), context.passed_on()};
  }

 private:
  // Batch of all personalize jobs of this process; created by the first one.
  SceneBatch* Batch(int threads) {
    const MutexLock lock(mutex_);
    if (!batch_) batch_ = std::make_unique<SceneBatch>(threads);
    return batch_.get();
  }

  static void RunStage(const StageRun& run, BlobSource& blobs, StageContext& context) {
    const JobSpec& spec = run.spec;
    switch (spec.stage_case()) {
      case JobSpec::kImportScene:
        return RunImportScene(ImportOptionsFrom(spec.import_scene()),
                              context,
                              SplatViewOptionsFrom(spec.import_scene()),
                              FilmOptionsFrom(spec.import_scene()));
      case JobSpec::kSelectKeyView:
        return RunSelectKeyView(SelectOptionsFrom(spec.select_key_view()), context);
      case JobSpec::kColorizeKeyView:
        return RunColorizeKeyView(KeyColorOptions(spec.colorize_key_view(), blobs), context);
      case JobSpec::kGenerateAugmentations:
        return RunGenerateAugmentations(AugmentationOptionsFrom(spec.generate_augmentations()),
                                        context);
      case JobSpec::kPersonalize:
        return RunPersonalize(
            PersonalizeOptions(spec.personalize(), context),
            context,
            spec.personalize().encoder(),
            FetchIf(spec.personalize().has_colorizer(), spec.personalize().colorizer(), blobs));
      case JobSpec::kCarryColor:
        return RunCarryColor(CarryOptionsFrom(spec.carry_color()), context);
      case JobSpec::kCorrectColors:
        return RunCorrectColors(
            CorrectOptions(spec.correct_colors(), blobs), context, spec.correct_colors().encoder());
      case JobSpec::kColorizeViews:
        return RunColorizeViews(ColorizeViewsOptionsFrom(spec.colorize_views()),
                                context,
                                spec.colorize_views().encoder());
      case JobSpec::kReconstructGeometry:
        return RunReconstructGeometry(
            GeometryOptionsFrom(spec.reconstruct_geometry(), context.seed()),
            spec.reconstruct_geometry().has_max_side_px()
                ? spec.reconstruct_geometry().max_side_px()
                : kDefaultMaxSidePx,
            context);
      case JobSpec::kSolveChroma:
        return RunSolveChroma(ChromaOptionsFrom(spec.solve_chroma(), context.seed()), context);
      case JobSpec::kExport:
        return RunExport(ExportOptionsFrom(spec.export_()), context);
      case JobSpec::kRender:
        return RunRender(MovieOptions(spec.render(), blobs), context);
      case JobSpec::kEvaluate:
        return RunEvaluation(spec.evaluate(), blobs, context);
      case JobSpec::kColorizeScene:
        return RunReport(run.graph, context);
      case JobSpec::kPersonalizeScenes:
        return;  // all work is done by its children
      case JobSpec::STAGE_NOT_SET:
        break;
    }  // no default: the compiler warns of a stage without a case
    throw Error(ErrorCode::kUnimplemented, "the job has no stage that this version knows");
  }

  Mutex mutex_;
  std::unique_ptr<SceneBatch> batch_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace

std::unique_ptr<StageRunner> MakeStageRunner() { return std::make_unique<CoreStageRunner>(); }

}  // namespace color3d
