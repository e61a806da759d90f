// The stages of the pipeline, one row each: the artifacts that a stage reads and writes, and how it
// is run. The planner, the worker, the store, the report and the client read the rows; the options
// of a stage are in the public API (stage.proto), its code is in core/stage. Constants.
#pragma once

#include <string_view>
#include <vector>

namespace color3d {

// Kinds of jobs: the names of the stages in color3d.v1.JobSpec. No other source spells them.
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
// Planned as graphs of the other kinds. The first one's own work is the report; the other has none.
inline constexpr char kColorizeScene[] = "colorize_scene";
inline constexpr char kPersonalizeScenes[] = "personalize_scenes";
}  // namespace kind

struct Stage {
  const char* kind;
  // Its step in the plan of a scene (plan.json) and the reason for which a scene needs it. nullptr
  // for kinds that are graphs of the others.
  const char* step = nullptr;
  const char* purpose = nullptr;
  std::vector<const char*> needs = {};  // artifacts that it cannot run without
  std::vector<const char*> reads = {};  // artifacts that it reads if they are among its inputs
  // Artifacts that it writes, some of them only if there is something to write, and those of them
  // that belong to a coloured scene. From artifacts.cc.
  std::vector<const char*> outputs = {};
  std::vector<const char*> results = {};
  // A job submitted alone also plans the stages that write what it needs, because they require no
  // decision of the user.
  bool brings_prerequisites = false;
  // A worker runs several jobs of this kind at once; they share an encoder and take turns.
  bool runs_in_batch = false;
  // Continues at the last checkpoint after its worker is lost.
  bool resumes = false;
  // Has the option time_limit_seconds; a time budget is divided among these stages.
  bool keeps_time_limit = false;
};

// In the order of the pipeline, the composite kinds last.
const std::vector<Stage>& StageCatalogue();

// Returns nullptr if there is no such kind.
const Stage* FindStage(std::string_view kind);

// Requires: the kind exists. Throws Error{kInternal}.
const Stage& StageOf(std::string_view kind);

// The stage that writes an artifact or the folder that it lies in; nullptr if there is none.
const Stage* FindProducer(std::string_view artifact);

}  // namespace color3d
