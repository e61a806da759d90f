// JobSpec messages -> option structs of the method library. Unset fields keep the struct's default;
// a value out of range is refused later by the struct's own Validate().
#pragma once

#include "color3d/v1/stage.pb.h"
#include "core/stage/run_stages.h"

namespace color3d {

ImportOptions ImportOptionsFrom(const v1::ImportSceneSpec& spec);
SplatViewOptions SplatViewOptionsFrom(const v1::ImportSceneSpec& spec);
FilmOptions FilmOptionsFrom(const v1::ImportSceneSpec& spec);
SelectKeyViewOptions SelectOptionsFrom(const v1::SelectKeyViewSpec& spec);
// Source and file are set by the caller, which holds the blobs.
HintOptions HintOptionsFrom(const v1::ColorizeKeyViewSpec& spec);
AugmentationOptions AugmentationOptionsFrom(const v1::GenerateAugmentationsSpec& spec);
ColorizerOptions ColorizerOptionsFrom(const v1::PersonalizeSpec& spec, uint64_t seed);
// Throws Error{kFailedPrecondition} for a job of a version that planned no jobs for additional key
// views.
CarryColorOptions CarryOptionsFrom(const v1::CarryColorSpec& spec);
// Corrections without a range of time are set by the caller, which holds the blobs. Throws as
// CarryOptionsFrom.
CorrectColorsOptions CorrectOptionsFrom(const v1::CorrectColorsSpec& spec);
GeometryOptions GeometryOptionsFrom(const v1::ReconstructGeometrySpec& spec, uint64_t seed);
ChromaOptions ChromaOptionsFrom(const v1::SolveChromaSpec& spec, uint64_t seed);
ExportOptions ExportOptionsFrom(const v1::ExportSpec& spec);
RenderOptions RenderOptionsFrom(const v1::RenderSpec& spec);

// Working size when a single-stage job does not say.
inline constexpr int kDefaultMaxSidePx = 500;

}  // namespace color3d
