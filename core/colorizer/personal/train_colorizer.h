// Makes personalized colorizers: by training, or from their files. No torch in this interface.
// Thread-safe.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/run_control.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/scene_batch.h"
#include "core/encoder/encoder.h"

namespace color3d {

// Error names in the progress of training: expected share of the decoder after all iterations, and
// CIEDE2000 on held-out crops of the key view. Training that is left out has the first one alone at
// its iterations, and the second one at iteration 0.
inline constexpr char kDecoderShareName[] = "decoder_share";

// Trains a colorizer. `pictures`: the undistorted key view first (statistics, neighbors and
// held-out augmentations are taken from it), then other pictures of the scene, of any size. Reports
// "train_l1_ab" and "validation_delta_e00", the latter on augmentations of the key view that are
// never trained on. A non-finite loss restores the last good state, halves
// the step and warns. Resumable. With a `place`, training takes turns with the other scenes of the
// batch. The result does not depend on the batch or the number of threads, bit for bit. The
// colorizer predicts on as many threads as the pool has.
std::shared_ptr<const Colorizer> TrainColorizer(std::shared_ptr<const Encoder> encoder,
                                                std::vector<TrainingPicture> pictures,
                                                const ColorizerOptions& options,
                                                const RunControl& control,
                                                const std::optional<BatchPlace>& place = {});

// Parts of a colorizer that predict colours (STILL.md "Blend of neighbours and decoder").
enum class ColorizerParts { kBoth, kNeighbors, kDecoder };

struct PredictionOptions {
  ColorizerParts parts = ColorizerParts::kBoth;
  bool full_size = false;  // pictures larger than the training size are not reduced
};

// Reads a colorizer file. The colorizer predicts on `threads` threads; 0: one per core. Throws
// Error{kInvalidArgument} if the file is damaged, kFailedPrecondition naming both digests if it was
// trained on another encoder, or if options.parts is kNeighbors and it has none.
std::shared_ptr<const Colorizer> LoadColorizer(std::string_view bytes,
                                               std::shared_ptr<const Encoder> encoder,
                                               int threads = 0,
                                               const PredictionOptions& options = {});

// Returns the file of a colorizer for use in another scene: positions in space, which mean nothing
// there, are removed. Throws as LoadColorizer.
std::string ColorizerForOtherScene(std::string_view bytes, std::shared_ptr<const Encoder> encoder);

}  // namespace color3d
