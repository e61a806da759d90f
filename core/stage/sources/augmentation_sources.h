// Training pictures from files of the user and from generators on model servers, for the stage
// generate_augmentations.
#pragma once

#include <string>
#include <vector>

#include "core/augment/surrogates.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/augmentation_options.h"

namespace color3d {

// "outpaint", "animate", "novel_view": as in stage.proto and backend.proto.
const char* AugmentationKindName(AugmentationKind kind);

// Name of an artifact, "outpaint-1" for the first (index 0) of its kind.
std::string AugmentationName(const std::string& kind, size_t index);

struct Augmentation {
  std::string name;    // name of the artifact, without folder and extension
  std::string kind;    // AugmentationKindName, or "file"
  std::string source;  // "embedded", "backend NAME", or the name of the file
  GeneratedPicture picture;
};

// Reads the coloured photos below augment/ of the scene's folder, sorted by name, and reduces them
// to `max_side_px`. Throws Error{kInvalidArgument} naming a file that is no picture, has no colour
// or is too small, and if there are too many.
std::vector<Augmentation> AugmentationsFromFiles(int max_side_px, const StageContext& context);

// Requests `count` pictures of one kind, made from `key_srgb` (3 channels, 0..1), from the
// generator options.backend, which must support the kind. Throws the errors of RemoteColorizer, and
// Error{kFailedPrecondition} for answers that are no coloured pictures.
std::vector<Augmentation> AugmentationsFromBackend(const AugmentationOptions& options,
                                                   RemoteColorizer& remote,
                                                   const RemoteInfo& info,
                                                   AugmentationKind kind,
                                                   int count,
                                                   const Image& key_srgb,
                                                   StageContext& context);

}  // namespace color3d
