// The functions that run the stages of the method. Their options are in options/, the artifacts
// that each reads and writes in core/catalogue/stages.cc. All throw Error and leave no half-written
// file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/catalogue/stage_summary.h"
#include "core/colorizer/colorizer.h"
#include "core/scene/import_options.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/geometry/geometry_options.h"
#include "core/splat/import/splat_scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/augmentation_options.h"
#include "core/stage/options/carry_color_options.h"
#include "core/stage/options/colorize_views_options.h"
#include "core/stage/options/correct_colors_options.h"
#include "core/stage/options/evaluate_options.h"
#include "core/stage/options/export_options.h"
#include "core/stage/options/film_options.h"
#include "core/stage/options/key_color_options.h"
#include "core/stage/options/render_options.h"
#include "core/stage/options/select_key_view_options.h"
#include "core/stage/options/working_size.h"

namespace color3d {

// Makes views with poses from the files of the scene, by structure-from-motion if they come without
// poses. From a splat (.ply, .sog, .spz) without photos: grey renders of views around it, and its
// Gaussians as the geometry. From a film: its frames, without poses.
void RunImportScene(const ImportOptions& options,
                    StageContext& context,
                    const SplatViewOptions& splat_views = {},
                    const FilmOptions& film = {});

// Selects the photo that the user should colour, or several, among the training views. Features of
// photos are cached in the cache folder of the context.
void RunSelectKeyView(const SelectKeyViewOptions& options, StageContext& context);

// Colours a key view. Writes its colours, a picture for people and facts about the source.
void RunColorizeKeyView(const ColorizeKeyViewOptions& options, StageContext& context);

// Carries the colours of the key views into every view, and measures how much of each they cover.
void RunCarryColor(const CarryColorOptions& options, StageContext& context);

// Makes training pictures beside the key view: the files in augment/ if requested, pictures of a
// generator, and our own. Novel views need the geometry among the inputs.
void RunGenerateAugmentations(const AugmentationOptions& options, StageContext& context);

// Trains the colorizer of the scene on the key view, carried colours and generated pictures. Warns
// if the key view has no colour. `encoder`: as in SelectKeyViewOptions. `other_colorizer`: file of
// another scene's colorizer, which is used in place of training; empty: none.
void RunPersonalize(const ColorizerOptions& options,
                    StageContext& context,
                    const std::string& encoder = "",
                    const std::filesystem::path& other_colorizer = {});

// Colours every view, with the sources of the colour. After an edit of the key photo of a static
// scene, colour photos keep their own colours outside the edit. `encoder`: the one that the
// colorizer was trained with.
void RunColorizeViews(const ColorizeViewsOptions& options,
                      StageContext& context,
                      const std::string& encoder = "");

// Corrects the colours of every view where the user painted and in similar places near that
// (STILL.md "Corrections"), or recolours ranges of time of a film. `encoder`: as in
// RunColorizeViews.
void RunCorrectColors(const CorrectColorsOptions& options,
                      StageContext& context,
                      const std::string& encoder = "");

// Trains Gaussians of luminance at max_side_px (64..4096). With little memory, size and number of
// Gaussians are reduced with a warning. Gaussians that came with the scene are kept as they are.
void RunReconstructGeometry(const GeometryOptions& options, int max_side_px, StageContext& context);

// Fits the chroma of the views on the geometry, or trains both together, with confidence if every
// training view has its provenance.
void RunSolveChroma(const ChromaOptions& options, StageContext& context);

// Writes the model in RGB formats for viewers, and their difference from our renders. For dynamic
// scenes, formats of a single time have that of the key view.
void RunExport(const ExportOptions& options, StageContext& context);

// Renders pictures of the model, or a movie.
void RunRender(const RenderOptions& options, StageContext& context);

// Scores the colours, with the compared pictures. Without true colours only the consistency of the
// views (ME, TC) is scored.
void RunEvaluate(const EvaluateOptions& options, StageContext& context);

// Writes the report on a coloured scene with metrics, curves and plan, and passes on the results of
// the other stages.
void RunReport(const std::vector<StageSummary>& stages, StageContext& context);

}  // namespace color3d
