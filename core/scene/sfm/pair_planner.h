// Which pairs of photos are worth matching for structure-from-motion, when matching all of them
// takes too long. Pure functions, thread-safe. For this folder only.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/sfm/photo_similarity.h"

namespace color3d {

// Indices of two photos, the smaller first.
using PhotoPair = std::pair<int, int>;

// The photos in the order in which they were taken, judged by their names: all alike but for the
// last number in them, which differs ("DSC_0107.jpg", "frame_9.png", "frame_10.png"). nullopt when
// the names do not tell.
std::optional<std::vector<int>> SequenceOrder(const std::vector<std::string>& names);

struct PairPlan {
  std::vector<PhotoPair> pairs;  // sorted, no repetitions
  std::string reason;            // one line: what was chosen and why
  // Photos that are clearly similar to another one; all of them where nothing was compared.
  int related = 0;
};

// All n (n - 1) / 2 pairs.
std::vector<PhotoPair> AllPairs(int count);

// Of frames that one camera or several took, each camera's one after the other: each with those 1,
// 2, 4, 8 and 16 further on of its own camera. `camera`: of each frame.
PairPlan PairsInSequence(const std::vector<int>& camera);

// The frames by which cameras are compared with each other: all of a few, else as many of each
// camera, spread evenly. Ascending; empty where there is one camera.
std::vector<int> FramesToCompare(const std::vector<int>& camera);

// Adds the pairs across cameras: each of the frames `compared` with the 4 of every other camera
// that are most like it, where they clearly are, and of every two cameras the 8 likest pairs at any
// rate. `similarity` is of `compared`.
void AddPairsAcross(const std::vector<int>& camera,
                    const std::vector<int>& compared,
                    const SimilarityTable& similarity,
                    PairPlan* plan);

// Every photo with the `neighbors` most similar ones (twice as many when none of them is clearly
// similar), with the next two of its sequence, if `sequence` is not empty (a permutation of the
// photos), and two spanning trees without a common pair, so that the photos hang together even when
// one link fails. All pairs when these are most of them anyway.
PairPlan PlanPairs(const SimilarityTable& similarity,
                   const std::vector<int>& sequence,
                   int neighbors);

// The pairs that `tried` lacks with a photo that found no place. `placed` has one entry per photo.
std::vector<PhotoPair> PairsOfUnplaced(const std::vector<bool>& placed,
                                       const std::vector<PhotoPair>& tried);

}  // namespace color3d
