// Colour photographs and frames of clips for pre-training, kept in memory as bytes, and random
// crops of them. Immutable after construction, thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/base/random.h"
#include "tests/bench/pretrain/crop_window.h"

namespace color3d {

struct PhotoFolder {
  std::filesystem::path path;  // searched recursively
  double weight = 1.0;         // share of the crops, relative to the other folders
};

struct TrainingCrop {
  Image srgb;       // 3 channels, input of the teacher
  Image luminance;  // 1 channel, L 0..100, degraded like old photographs, input of the student
  Image ab;         // 2 channels, Lab units, ground truth
};

// Two views of the same objects: crops of one photo at different scales, or of two frames.
struct TrainingPair {
  TrainingCrop first;
  TrainingCrop second;
  // 2 channels at 1/4 of the crops' size: where in `first` (px, x and y) the middle of each cell of
  // `second` lies. -1 where `first` does not show it or it is unknown (another frame).
  Image matches;
};

class PhotoSet {
 public:
  // Each folder below one of `clips` that holds pictures is a clip, its frames in the order of
  // their names. Grey photographs are left out. Throws Error{kInvalidArgument} for a folder without
  // photographs.
  explicit PhotoSet(const std::vector<PhotoFolder>& folders,
                    const std::vector<PhotoFolder>& clips = {});

  size_t size() const { return photos_.size(); }  // photos and frames
  // Returns a random crop of a random photo at random scale, size_px x size_px, possibly mirrored.
  TrainingCrop Crop(int size_px, Random& random) const;
  // `size_px`: a multiple of 4.
  TrainingPair Pair(int size_px, Random& random) const;

 private:
  // A photo, or the frames of a clip.
  struct Group {
    size_t first = 0;
    size_t count = 1;
  };
  // Groups with the same folder as parent or, for photos, one each. Returns how many.
  size_t AddFolder(const std::filesystem::path& folder, bool clips);
  const Group& PickGroup(Random& random) const;

  std::vector<BytePhoto> photos_;
  std::vector<Group> groups_;
  std::vector<double> upper_;  // cumulative share of the groups
};

}  // namespace color3d
