// Plans the pairs of photos to match for structure-from-motion if matching all of them takes too
// long. Pure functions, thread-safe. For this folder only.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/sfm/photo_similarity.h"

namespace color3d {

// Indices of two photos, the smaller first.
using PhotoPair = std::pair<int, int>;

// Returns the photos in the order of capture, judged by names that are equal except for their last
// number ("DSC_0107.jpg", "frame_9.png", "frame_10.png"); nullopt if the names have no such order.
std::optional<std::vector<int>> SequenceOrder(const std::vector<std::string>& names);

struct PairPlan {
  std::vector<PhotoPair> pairs;  // sorted, no repetitions
  std::string reason;            // one line: what was chosen and why
  // Photos that are clearly similar to another one; all of them if none were compared.
  int related = 0;
};

// Returns all n (n - 1) / 2 pairs.
std::vector<PhotoPair> AllPairs(int count);

// Returns pairs of consecutive frames of one or several cameras: each frame with those 1, 2, 4, 8
// and 16 frames later of its own camera. `camera`: of each frame.
PairPlan PairsInSequence(const std::vector<int>& camera);

// Returns the frames by which cameras are compared: all if there are few, else equally many of each
// camera, evenly spread. Ascending; empty for a single camera.
std::vector<int> FramesToCompare(const std::vector<int>& camera);

// Adds pairs across cameras: each frame of `compared` with the 4 most similar frames of every other
// camera, if clearly similar, and the 8 most similar pairs of every two cameras in any case.
// `similarity`: of `compared`.
void AddPairsAcross(const std::vector<int>& camera,
                    const std::vector<int>& compared,
                    const SimilarityTable& similarity,
                    PairPlan* plan);

// Returns pairs of every photo with its `neighbors` most similar ones (twice as many if none is
// clearly similar), with the next two of `sequence` if it is not empty (a permutation of the
// photos), and two edge-disjoint spanning trees, so that the photos stay connected if one link
// fails. All pairs if these are most of them.
PairPlan PlanPairs(const SimilarityTable& similarity,
                   const std::vector<int>& sequence,
                   int neighbors);

// Returns the pairs with an unregistered photo that `tried` lacks. `placed`: one entry for each
// photo.
std::vector<PhotoPair> UnregisteredPairs(const std::vector<bool>& placed,
                                         const std::vector<PhotoPair>& tried);

}  // namespace color3d
