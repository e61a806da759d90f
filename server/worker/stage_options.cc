#include "server/worker/stage_options.h"

#include "core/base/error.h"
#include "server/planning/asked_formats.h"
#include "server/planning/key_view_jobs.h"

namespace color3d {
namespace {

ColorizerOptions::Precision PrecisionFrom(v1::PersonalizeSpec::Precision precision) {
  switch (precision) {
    case v1::PersonalizeSpec::PRECISION_FLOAT32:
      return ColorizerOptions::Precision::kFloat32;
    case v1::PersonalizeSpec::PRECISION_BFLOAT16:
      return ColorizerOptions::Precision::kBfloat16;
    default:
      return ColorizerOptions::Precision::kAuto;
  }
}

ColorizeViewsOptions::Method MethodFrom(v1::ColorizeViewsSpec::Method method) {
  using Method = ColorizeViewsOptions::Method;
  switch (method) {
    case v1::ColorizeViewsSpec::METHOD_PERSONALIZED:
      return Method::kPersonalized;
    case v1::ColorizeViewsSpec::METHOD_NEAREST_NEIGHBORS:
      return Method::kNearestNeighbors;
    case v1::ColorizeViewsSpec::METHOD_DECODER:
      return Method::kDecoder;
    case v1::ColorizeViewsSpec::METHOD_CARRIED:
      return Method::kCarried;
    case v1::ColorizeViewsSpec::METHOD_AUTOMATIC:
      return Method::kAutomatic;
    case v1::ColorizeViewsSpec::METHOD_FLOW:
      return Method::kFlow;
    case v1::ColorizeViewsSpec::METHOD_GRAY:
      return Method::kGray;
    default:
      return Method::kFusion;
  }
}

void SetElastic(const v1::PersonalizeSpec& spec, ElasticOptions* elastic) {
  if (spec.elastic() != v1::PersonalizeSpec::ELASTIC_UNSPECIFIED) {
    elastic->kind = spec.elastic() == v1::PersonalizeSpec::ELASTIC_NOISE
                        ? ElasticOptions::Kind::kNoise
                        : ElasticOptions::Kind::kSpline;
  }
  if (spec.has_elastic_alpha_px()) elastic->alpha_px = spec.elastic_alpha_px();
  if (spec.has_elastic_sigma_px()) elastic->sigma_px = spec.elastic_sigma_px();
  if (spec.has_elastic_affine_px()) elastic->affine_px = spec.elastic_affine_px();
}

// Throws if the job was planned by a version whose stages coloured additional key views themselves.
void RequireColoredBefore(const v1::FurtherKeyView& key) {
  if (!key.has_color()) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "an earlier version of the server planned this job without a job that colours the "
              "additional key view {}; submit it again",
              key.view());
}

}  // namespace

ImportOptions ImportOptionsFrom(const v1::ImportSceneSpec& spec) {
  ImportOptions options;
  options.hold_out_every_eighth = spec.hold_out_every_eighth();
  options.hold_out_camera = spec.hold_out_camera();
  options.hold_out_block = spec.hold_out_block();
  if (spec.has_sfm_max_image_side_px())
    options.sfm_max_image_side_px = spec.sfm_max_image_side_px();
  if (spec.sfm_pairs() == v1::ImportSceneSpec::SFM_PAIRS_EXHAUSTIVE) {
    options.sfm_pairs = SfmPairs::kExhaustive;
  }
  if (spec.has_sfm_max_features()) options.sfm_max_features = spec.sfm_max_features();
  if (spec.has_sfm_timeout_seconds()) {
    options.sfm_timeout = std::chrono::seconds(spec.sfm_timeout_seconds());
  }
  return options;
}

SplatViewOptions SplatViewOptionsFrom(const v1::ImportSceneSpec& spec) {
  SplatViewOptions options;
  if (spec.has_splat_views()) options.views = spec.splat_views();
  if (spec.has_splat_view_side_px()) options.side_px = spec.splat_view_side_px();
  if (spec.splat_up() == v1::ImportSceneSpec::SPLAT_UP_Y) options.up = SplatUp::kY;
  if (spec.splat_up() == v1::ImportSceneSpec::SPLAT_UP_Z) options.up = SplatUp::kZ;
  return options;
}

FilmOptions FilmOptionsFrom(const v1::ImportSceneSpec& spec) {
  FilmOptions options;
  if (spec.has_film_stride()) options.stride = spec.film_stride();
  if (spec.has_film_begin_s()) options.begin_s = spec.film_begin_s();
  if (spec.has_film_end_s()) options.end_s = spec.film_end_s();
  if (spec.has_film_frames_per_second()) options.frames_per_second = spec.film_frames_per_second();
  options.deflicker = spec.film_deflicker();
  if (spec.film_poses() == v1::ImportSceneSpec::FILM_POSES_AUTO) options.poses = FilmPoses::kAuto;
  return options;
}

SelectKeyViewOptions SelectOptionsFrom(const v1::SelectKeyViewSpec& spec) {
  SelectKeyViewOptions options;
  options.view = spec.view();
  options.encoder = spec.encoder();
  options.features = spec.features();
  switch (spec.strategy()) {
    case v1::SelectKeyViewSpec::STRATEGY_ENTROPY:
      options.selection.strategy = KeyViewStrategy::kEntropy;
      break;
    case v1::SelectKeyViewSpec::STRATEGY_TRACKS:
      options.selection.strategy = KeyViewStrategy::kTracks;
      break;
    case v1::SelectKeyViewSpec::STRATEGY_RANDOM:
      options.selection.strategy = KeyViewStrategy::kRandom;
      break;
    case v1::SelectKeyViewSpec::STRATEGY_MANUAL:
      options.selection.strategy = KeyViewStrategy::kManual;
      break;
    default:
      options.selection.strategy = KeyViewStrategy::kCoverage;
  }
  if (spec.has_temperature()) options.selection.temperature = spec.temperature();
  if (spec.has_exclude_self()) options.selection.exclude_self = spec.exclude_self();
  if (spec.has_outlier_guard()) options.selection.outlier_guard = spec.outlier_guard();
  if (spec.has_count()) options.selection.count = spec.count();
  return options;
}

HintOptions HintOptionsFrom(const v1::ColorizeKeyViewSpec& spec) {
  HintOptions options;
  if (spec.has_hint_sigma()) options.sigma = spec.hint_sigma();
  return options;
}

AugmentationOptions AugmentationOptionsFrom(const v1::GenerateAugmentationsSpec& spec) {
  using Spec = v1::GenerateAugmentationsSpec;
  AugmentationOptions options;
  options.backend = spec.backend();
  if (spec.has_samples()) options.samples = spec.samples();
  if (spec.has_max_side_px()) options.max_side_px = spec.max_side_px();
  options.files = spec.files();
  if (spec.kinds().empty()) return options;
  options.outpaint = options.animate = options.novel_views = false;
  for (const int kind : spec.kinds()) {
    options.outpaint = options.outpaint || kind == Spec::KIND_OUTPAINT;
    options.animate = options.animate || kind == Spec::KIND_ANIMATE;
    options.novel_views = options.novel_views || kind == Spec::KIND_NOVEL_VIEW;
  }
  return options;
}

ColorizerOptions ColorizerOptionsFrom(const v1::PersonalizeSpec& spec, uint64_t seed) {
  ColorizerOptions options;
  options.seed = seed;
  if (spec.recipe() == v1::PersonalizeSpec::RECIPE_PAPER) options.UsePaperRecipe();
  SetElastic(spec, &options.elastic);
  if (spec.has_max_gradient_norm()) options.max_gradient_norm = spec.max_gradient_norm();
  if (spec.has_equal_draws()) options.equal_draws = spec.equal_draws();
  if (spec.has_full_resolution()) options.full_resolution = spec.full_resolution();
  if (spec.has_adapter_stages()) options.adapter_stages = spec.adapter_stages();
  if (spec.has_instance_norm()) options.instance_norm = spec.instance_norm();
  if (spec.recipe() == v1::PersonalizeSpec::RECIPE_FEED_FORWARD) {
    options.recipe = ColorizerOptions::Recipe::kFeedForward;
  }
  if (spec.has_iterations()) options.iterations = spec.iterations();
  if (spec.has_time_limit_seconds()) options.time_limit_seconds = spec.time_limit_seconds();
  if (spec.has_max_side_px()) options.max_side_px = spec.max_side_px();
  if (spec.has_crop_px()) options.crop_px = spec.crop_px();
  if (spec.has_consistency_weight()) options.consistency_weight = spec.consistency_weight();
  options.precision = PrecisionFrom(spec.precision());
  if (spec.has_average_decay()) options.average_decay = spec.average_decay();
  if (spec.has_min_improvement()) options.min_improvement = spec.min_improvement();
  if (spec.has_min_decoder_share()) options.min_decoder_share = spec.min_decoder_share();
  if (spec.has_augment()) options.augment = spec.augment();
  if (spec.has_neighbors()) options.neighbors = spec.neighbors();
  return options;
}

CarryColorOptions CarryOptionsFrom(const v1::CarryColorSpec& spec) {
  CarryColorOptions options;
  if (spec.has_max_side_px()) options.max_side_px = spec.max_side_px();
  if (spec.has_flow_tolerance_px()) options.carry.flow_tolerance_px = spec.flow_tolerance_px();
  if (spec.has_depth_tolerance()) options.carry.depth_tolerance = spec.depth_tolerance();
  if (spec.has_luminance_tolerance())
    options.carry.luminance_tolerance = spec.luminance_tolerance();
  if (spec.has_depth_side_px()) options.depth_side_px = spec.depth_side_px();
  if (spec.has_depth_sources()) options.depth_sources = spec.depth_sources();
  if (spec.has_flow_check() && !spec.flow_check()) options.carry.flow_tolerance_px = 0.0;
  for (const v1::FurtherKeyView& key : spec.further_key_views()) {
    RequireColoredBefore(key);
    options.additional_key_views.push_back(key.view());
  }
  return options;
}

ColorizeViewsOptions ColorizeViewsOptionsFrom(const v1::ColorizeViewsSpec& spec) {
  ColorizeViewsOptions options;
  if (spec.has_max_side_px()) options.max_side_px = spec.max_side_px();
  options.method = MethodFrom(spec.method());
  if (spec.has_guess()) options.guess = spec.guess();
  if (spec.has_spread()) options.spread = spec.spread();
  options.full_size = spec.full_size();
  return options;
}

CorrectColorsOptions CorrectOptionsFrom(const v1::CorrectColorsSpec& spec) {
  CorrectColorsOptions options;
  if (spec.has_proposals()) options.proposals = spec.proposals();
  for (const v1::FurtherKeyView& correction : spec.corrections()) {
    if (!HasRange(correction)) continue;
    RequireColoredBefore(correction);
    RangeKeyView& range = options.ranges.emplace_back();
    range.view = correction.view();
    if (correction.has_begin_s()) range.begin_s = correction.begin_s();
    if (correction.has_end_s()) range.end_s = correction.end_s();
  }
  return options;
}

GeometryOptions GeometryOptionsFrom(const v1::ReconstructGeometrySpec& spec, uint64_t seed) {
  GeometryOptions options;
  options.seed = seed;
  if (spec.has_iterations()) options.iterations = spec.iterations();
  if (spec.has_max_gaussians()) options.max_gaussians = spec.max_gaussians();
  if (spec.has_sh_degree()) options.sh_degree = spec.sh_degree();
  if (spec.has_ssim_weight()) options.ssim_weight = spec.ssim_weight();
  if (spec.has_edge_weight()) options.edge_weight = spec.edge_weight();
  if (spec.has_densify_gradient()) options.densify_gradient = spec.densify_gradient();
  if (spec.has_time_limit_seconds()) options.time_limit_seconds = spec.time_limit_seconds();
  if (spec.recipe() == v1::ReconstructGeometrySpec::RECIPE_PAPER) {
    options.recipe = GeometryOptions::Recipe::kPaper;
  }
  if (spec.has_dense_start()) options.dense_start = spec.dense_start();
  if (spec.still()) options.motion = GeometryOptions::Motion::kStill;
  if (spec.deformation() == v1::ReconstructGeometrySpec::DEFORMATION_HEXPLANE) {
    options.deformation = GeometryOptions::Deformation::kHexPlane;
  }
  if (spec.has_warm_up()) options.warm_up = spec.warm_up();
  return options;
}

ChromaOptions ChromaOptionsFrom(const v1::SolveChromaSpec& spec, uint64_t seed) {
  ChromaOptions options;
  options.seed = seed;
  if (spec.has_iterations()) options.iterations = spec.iterations();
  if (spec.has_chroma_sh_degree()) options.chroma_sh_degree = spec.chroma_sh_degree();
  if (spec.has_ssim_weight()) options.ssim_weight = spec.ssim_weight();
  if (spec.has_time_limit_seconds()) options.time_limit_seconds = spec.time_limit_seconds();
  if (spec.solver() == v1::SolveChromaSpec::SOLVER_ADAM) {
    options.solver = ChromaOptions::Solver::kAdam;
  }
  if (spec.solver() == v1::SolveChromaSpec::SOLVER_JOINT) {
    options.solver = ChromaOptions::Solver::kJoint;
  }
  if (spec.color_space() == v1::SolveChromaSpec::COLOR_SPACE_RGB) {
    options.color_space = ColorSpace::kSrgb;
  }
  if (spec.has_saturation()) options.adjustment.saturation = spec.saturation();
  if (spec.has_tint()) options.adjustment.tint = spec.tint();
  if (spec.has_warmth()) options.adjustment.warmth = spec.warmth();
  return options;
}

ExportOptions ExportOptionsFrom(const v1::ExportSpec& spec) {
  ExportOptions options;
  options.formats = AskedFormats(spec);
  if (spec.has_spz_version()) options.spz_version = spec.spz_version();
  options.confidence = spec.confidence();
  options.moments = spec.moments();
  return options;
}

RenderOptions RenderOptionsFrom(const v1::RenderSpec& spec) {
  RenderOptions options;
  options.views.assign(spec.views().begin(), spec.views().end());
  if (spec.has_max_views()) options.max_views = spec.max_views();
  if (spec.has_max_side_px()) options.max_side_px = spec.max_side_px();
  switch (spec.path()) {
    case v1::RenderSpec::PATH_ORBIT:
      options.path = RenderOptions::Path::kOrbit;
      break;
    case v1::RenderSpec::PATH_PHOTOS:
      options.path = RenderOptions::Path::kPhotos;
      break;
    case v1::RenderSpec::PATH_CAMERAS:
      options.path = RenderOptions::Path::kCameras;
      break;
    case v1::RenderSpec::PATH_STILL:
      options.path = RenderOptions::Path::kStill;
      break;
    default:
      options.path = RenderOptions::Path::kViews;
  }
  if (spec.has_frames()) options.frames = spec.frames();
  if (spec.has_frames_per_second()) options.frames_per_second = spec.frames_per_second();
  if (spec.has_video()) options.video = spec.video();
  options.pictures = spec.pictures();
  options.bounce = spec.bounce();
  if (spec.has_time_s()) options.time_s = spec.time_s();
  return options;
}

}  // namespace color3d
