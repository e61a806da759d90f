// The options of PRESET_PAPER, resolved to those that the stages get, against the paper's values.
// PAPER.md has the same rows in prose.
#include <gtest/gtest.h>

#include <vector>

#include "core/augment/augment.h"
#include "core/colorizer/training/recipe.h"
#include "server/worker/stage_options.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {

// What the stages get, as planned for a job that gives nothing but the preset.
struct Resolved {
  KeyViewOptions key_view;
  bool carries = false;
  AugmentationOptions generated;
  ColorizerOptions colorizer;
  TrainingRecipe recipe;  // of `colorizer`
  ColorizeViewsOptions views;
  GeometryOptions geometry;
  ChromaOptions chroma;
  int max_side_px = 0;  // of the job
};

Resolved PaperPreset() {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_preset(v1::PRESET_PAPER);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  Resolved r;
  r.key_view = SelectOptionsFrom(SpecOf(graph, "select_key_view").select_key_view()).selection;
  r.carries = graph.jobs[IndexOf(graph, "carry_color")].skip_reason.empty();
  r.generated =
      AugmentationOptionsFrom(SpecOf(graph, "generate_augmentations").generate_augmentations());
  r.colorizer = ColorizerOptionsFrom(SpecOf(graph, "personalize").personalize(), 1);
  r.recipe = RecipeFor(r.colorizer);
  r.views = ColorizeViewsOptionsFrom(SpecOf(graph, "colorize_views").colorize_views());
  r.geometry = GeometryOptionsFrom(SpecOf(graph, "reconstruct_geometry").reconstruct_geometry(), 1);
  r.chroma = ChromaOptionsFrom(SpecOf(graph, "solve_chroma").solve_chroma(), 1);
  r.max_side_px = SpecOf(graph, "render").render().max_side_px();
  return r;
}

// "silent": the paper prints no value, and that of its released code is taken.
struct Row {
  const char* item;
  double paper;
  const char* section;
  double ours;
};

// 1 if the value is the expected one, else 0.
template <typename T>
double Is(T value, T expected) {
  return value == expected ? 1.0 : 0.0;
}

std::vector<Row> ColorRows(const Resolved& r) {
  const AugmentOptions& augment = r.recipe.augment;
  return {
      {"key view: argmax of the entropy",
       1,
       "3.2",
       Is(r.key_view.strategy, KeyViewStrategy::kEntropy)},
      {"key view: temperature of the softmax", 1, "3.2", r.key_view.temperature},
      {"key view: the view itself takes part", 0, "3.2", 1.0 * r.key_view.exclude_self},
      {"key view: views excluded as outliers", 0, "3.2", 1.0 * r.key_view.outlier_guard},
      {"colours carried by geometry", 0, "3.2", 1.0 * r.carries},
      {"generated pictures", 8, "A, tuning", 1.0 * r.generated.samples},
      {"generated: outpainting", 1, "3.2", 1.0 * r.generated.outpaint},
      {"generated: image to video", 1, "3.2", 1.0 * r.generated.animate},
      {"generated: novel views", 1, "3.2", 1.0 * r.generated.novel_views},
      {"generated: longer side, of the views", 1600, "silent", 1.0 * r.generated.max_side_px},
      {"samples drawn equally", 1, "A, tuning", 1.0 * r.colorizer.equal_draws},
      {"training pictures: longer side, of the views",
       1600,
       "silent",
       1.0 * r.colorizer.max_side_px},
      {"crop, px", 320, "A, tuning", 1.0 * r.colorizer.crop_px},
      {"iterations", 4000, "A, tuning", 1.0 * r.colorizer.iterations},
      {"learning rate, first", 1e-4, "A, tuning", r.recipe.first_learning_rate},
      {"learning rate, last", 1e-6, "A, tuning", r.recipe.last_learning_rate},
      {"learning rate: iterations of warm-up", 0, "A, tuning", 1.0 * r.recipe.warmup_iterations},
      {"stop before the end of the schedule", 0, "A, tuning", r.colorizer.min_improvement},
      {"limit of the gradient's norm", 0, "A, tuning", r.colorizer.max_gradient_norm},
      {"average of the parameters", 0, "A, tuning", r.colorizer.average_decay},
      {"float32", 1, "silent", Is(r.colorizer.precision, ColorizerOptions::Precision::kFloat32)},
      {"consistency term", 0, "3.2, eq. 3", r.colorizer.consistency_weight},
      {"adapters in all stages", 8, "3.2, A.2", 1.0 * r.recipe.model.adapter_stages},
      {"instance norm", 1, "A.2", 1.0 * r.recipe.model.instance_norm},
      {"nearest neighbours beside the decoder", 0, "3.2", 1.0 * r.recipe.neighbors},
      {"decoder at the size of the picture", 1, "silent", 1.0 * r.recipe.model.full_resolution},
      {"augment: flip", 0.5, "silent", augment.flip_probability},
      {"augment: rotation by a random quarter turn", 1, "silent", augment.rot90_probability},
      {"augment: grid shuffle", 0.7, "silent", augment.shuffle_probability},
      {"augment: cells a side", 8, "silent", 1.0 * augment.shuffle_grid},
      {"augment: elastic", 0.7, "silent", augment.elastic_probability},
      {"augment: elastic is blurred noise",
       1,
       "3.2",
       Is(augment.elastic.kind, ElasticOptions::Kind::kNoise)},
      {"augment: elastic alpha", 15, "silent", augment.elastic.alpha_px},
      {"augment: elastic sigma", 50, "silent", augment.elastic.sigma_px},
      {"augment: elastic affine", 50, "silent", augment.elastic.affine_px},
      {"augment: perspective", 0, "3.2", augment.perspective_probability},
      {"augment: smallest scale", 1, "3.2", augment.min_scale},
      {"augment: largest scale", 1, "3.2", augment.max_scale},
      {"augment: change of luminance", 0, "3.2", augment.luminance_jitter},
      {"views coloured by the colorizer alone",
       1,
       "3.3",
       Is(r.views.method, ColorizeViewsOptions::Method::kPersonalized)},
      {"views answered at full size", 1, "3.3", 1.0 * r.views.full_size},
      {"views: longer side", 1600, "silent", 1.0 * r.views.max_side_px},
  };
}

std::vector<Row> GeometryRows(const Resolved& r) {
  return {
      {"iterations", 30'000, "4.1", 1.0 * r.geometry.iterations},
      {"share of the warm-up", 0.5, "3.3, Warm-Up", r.geometry.warm_up},
      {"degree of the harmonics", 3, "3.3", 1.0 * r.geometry.sh_degree},
      {"degree of the harmonics of a and b", 3, "3.3", 1.0 * r.chroma.chroma_sh_degree},
      {"share of D-SSIM", 0.2, "3.3, eq. 6", r.geometry.ssim_weight},
      {"weight of the edge loss", 1, "3.3, eq. 6", r.geometry.edge_weight},
  };
}

void ExpectEqual(const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    EXPECT_EQ(row.ours, row.paper) << row.item << " (" << row.section << ")";
  }
}

TEST(PaperRecipeTest, ColorIsThePapers) { ExpectEqual(ColorRows(PaperPreset())); }

TEST(PaperRecipeTest, GeometryAndChromaAreThePapers) { ExpectEqual(GeometryRows(PaperPreset())); }

}  // namespace
}  // namespace color3d
