// Converts JobSpec messages to option structs of the method library. Unset fields keep the default
// of the struct; Validate() of the struct rejects values out of range. Stateless.
#pragma once

#include "color3d/v1/stage.pb.h"
#include "core/stage/run_stages.h"

namespace color3d {

ImportOptions ImportOptionsFrom(const v1::ImportSceneSpec& spec);
SplatViewOptions SplatViewOptionsFrom(const v1::ImportSceneSpec& spec);
FilmOptions FilmOptionsFrom(const v1::ImportSceneSpec& spec);
SelectKeyViewOptions SelectOptionsFrom(const v1::SelectKeyViewSpec& spec);
// The caller, which has the blobs, sets source and file.
HintOptions HintOptionsFrom(const v1::ColorizeKeyViewSpec& spec);
AugmentationOptions AugmentationOptionsFrom(const v1::GenerateAugmentationsSpec& spec);
ColorizerOptions ColorizerOptionsFrom(const v1::PersonalizeSpec& spec, uint64_t seed);
// Throws Error{kFailedPrecondition} for jobs of a version that did not plan jobs for additional key
// views.
CarryColorOptions CarryOptionsFrom(const v1::CarryColorSpec& spec);
ColorizeViewsOptions ColorizeViewsOptionsFrom(const v1::ColorizeViewsSpec& spec);
// The caller, which has the blobs, sets corrections without a time range. Throws like
// CarryOptionsFrom.
CorrectColorsOptions CorrectOptionsFrom(const v1::CorrectColorsSpec& spec);
GeometryOptions GeometryOptionsFrom(const v1::ReconstructGeometrySpec& spec, uint64_t seed);
ChromaOptions ChromaOptionsFrom(const v1::SolveChromaSpec& spec, uint64_t seed);
ExportOptions ExportOptionsFrom(const v1::ExportSpec& spec);
RenderOptions RenderOptionsFrom(const v1::RenderSpec& spec);

// Default working size of a single-stage job.
inline constexpr int kDefaultMaxSidePx = 500;

}  // namespace color3d
