// The stages of the pipeline, one row each: what a stage reads, what it leaves, how it is run. The
// planner, the worker, the store, the report and the client take these facts from here; a stage's
// options are in the public API (stage.proto), its code in core/stage.
#pragma once

#include <string_view>
#include <vector>

namespace color3d {

// Kinds of jobs, as the fields of color3d.v1.JobSpec are named. The only place where C++ spells
// them.
namespace kind {
inline constexpr char kImportScene[] = "import_scene";
inline constexpr char kSelectKeyView[] = "select_key_view";
inline constexpr char kColorizeKeyView[] = "colorize_key_view";
inline constexpr char kReconstructGeometry[] = "reconstruct_geometry";
inline constexpr char kCarryColor[] = "carry_color";
inline constexpr char kCorrectColors[] = "correct_colors";
inline constexpr char kGenerateAugmentations[] = "generate_augmentations";
inline constexpr char kPersonalize[] = "personalize";
inline constexpr char kColorizeViews[] = "colorize_views";
inline constexpr char kSolveChroma[] = "solve_chroma";
inline constexpr char kExport[] = "export";
inline constexpr char kRender[] = "render";
inline constexpr char kEvaluate[] = "evaluate";
// Planned as a graph of the others; their own work is the report, or nothing.
inline constexpr char kColorizeScene[] = "colorize_scene";
inline constexpr char kPersonalizeScenes[] = "personalize_scenes";
}  // namespace kind

struct Stage {
  const char* kind;
  // Artifacts that it cannot run without, and others that it reads when they are among its inputs.
  std::vector<const char*> needs = {};
  std::vector<const char*> reads = {};
  // Artifacts that it makes, some of them only when there is something to tell. The first is always
  // made, and is what other stages ask it for.
  std::vector<const char*> leaves = {};
  // Those of them that people get with a coloured scene: its report publishes them again.
  std::vector<const char*> results = {};
  // A job of its own plans the stages along that make what it needs: they want no decision of the
  // user's.
  bool brings_prerequisites = false;
  // One worker runs many jobs of this kind at once; they share an encoder and take turns.
  bool runs_in_batch = false;
  // A lost worker's successor goes on at the last checkpoint.
  bool resumes = false;
  // Has the option time_limit_seconds; a time budget is divided among these.
  bool keeps_time_limit = false;
};

// In the order of the pipeline, the composite kinds last.
const std::vector<Stage>& StageCatalogue();

// Nothing where there is no such kind.
const Stage* FindStage(std::string_view kind);

// The row of a kind that is known to exist. Throws Error{kInternal}.
const Stage& StageOf(std::string_view kind);

// The stage that makes an artifact or the folder that it lies in; nothing when there is none.
const Stage* StageThatLeaves(std::string_view artifact);

}  // namespace color3d
