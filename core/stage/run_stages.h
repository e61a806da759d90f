// The functions that run the stages of the method. Their options are in options/, the artifacts
// that each reads and writes in core/catalogue/stages.cc. All throw Error and leave no half-written
// file.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/carry/view_color.h"
#include "core/catalogue/stage_summary.h"
#include "core/colorizer/colorizer.h"
#include "core/scene/import_options.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/geometry/geometry_options.h"
#include "core/splat/import/splat_scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/augmentation_options.h"
#include "core/stage/options/carry_color_options.h"
#include "core/stage/options/correct_colors_options.h"
#include "core/stage/options/evaluate_options.h"
#include "core/stage/options/export_options.h"
#include "core/stage/options/film_options.h"
#include "core/stage/options/key_color_options.h"
#include "core/stage/options/render_options.h"
#include "core/stage/options/select_key_view_options.h"
#include "core/stage/options/working_size.h"

namespace color3d {

// The scene's files as views with poses; structure-from-motion where they have none. A scene of one
// splat (.ply, .sog, .spz) and no photos: views chosen around it and drawn in grey, and its
// Gaussians, which are the geometry. A film: its frames, without poses.
void RunImportScene(const ImportOptions& options,
                    StageContext& context,
                    const SplatViewOptions& splat_views = {},
                    const FilmOptions& film = {});

// The photo that the user should colour, or several. Only training views can win. Features of
// photos that were seen before come from the context's cache folder.
void RunSelectKeyView(const SelectKeyViewOptions& options, StageContext& context);

// Colours a key view. Writes its colours, a picture for people and facts about the source.
void RunColorizeKeyView(const ColorizeKeyViewOptions& options, StageContext& context);

// Carries the colours of the key views into every view, and measures how much of each they cover.
void RunCarryColor(const CarryColorOptions& options, StageContext& context);

// Training pictures beside the key view: the files below augment/ of the scene's folder if they are
// asked for, a generator's, and ours. Novel views need the geometry among the inputs.
void RunGenerateAugmentations(const AugmentationOptions& options, StageContext& context);

// The scene's colorizer, trained on the key view, what was carried and what was generated. Warns
// when the key view has no colour. `encoder`: as SelectKeyViewOptions.
void RunPersonalize(const ColorizerOptions& options,
                    StageContext& context,
                    const std::string& encoder = "");

// The colour of every view and where it comes from, at max_side_px (64..4096). `encoder`: the one
// that the colorizer was trained with.
void RunColorizeViews(int max_side_px, StageContext& context, const std::string& encoder = "");
// Whom it asks for colours: the scene's colorizer, which must outlive the answer, and the embedded
// automatic one. `position` gives PictureFacts' of the luminance; asked for with the colour.
ColorSources SourcesOf(const Colorizer& colorizer,
                       std::function<Image(const Image& luminance)> position = {});

// Corrects the colours of every view where the user painted and in similar places near that
// (METHOD.md "Corrections"), or recolours ranges of time of a film. `encoder`: as in
// RunColorizeViews.
void RunCorrectColors(const CorrectColorsOptions& options,
                      StageContext& context,
                      const std::string& encoder = "");

// Gaussians of luminance, trained at max_side_px (64..4096). With little memory the size and the
// number of Gaussians are smaller, and a warning says so. Gaussians that came with the scene are
// handed on as they are.
void RunReconstructGeometry(const GeometryOptions& options, int max_side_px, StageContext& context);

// The views' chroma on the geometry, with confidence when every training view has its provenance.
void RunSolveChroma(const ChromaOptions& options, StageContext& context);

// The model for viewers in RGB, and what that loses against our renders. Of a scene that moves it
// is that of the key view's moment.
void RunExport(const ExportOptions& options, StageContext& context);

// Pictures of the model, or a movie.
void RunRender(const RenderOptions& options, StageContext& context);

// Scores, with the pictures that were compared. Without any truth only the consistency between
// views (ME, TC) is scored.
void RunEvaluate(const EvaluateOptions& options, StageContext& context);

// The report on a coloured scene, its metrics, curves and plan; results of the other stages are
// passed on.
void RunReport(const std::vector<StageSummary>& stages, StageContext& context);

}  // namespace color3d
