// Carries colours between photos whose cameras are not known, by planes that local features find
// (STILL.md "Photos without a scene").
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/carry/carry.h"
#include "core/film/film_carry.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

class PictureCarry {
 public:
  // `images`: of a scene with `count` views. `channels` of colours: 2 (ab) or 3 (and the edited
  // share). The references must outlive the object.
  PictureCarry(const ViewImages& images,
               int count,
               int channels,
               const FilmCarryOptions& options,
               StageContext& context);

  // Sets the colours of a picture, which are not changed by Run.
  void Set(int picture, const CarriedColor& color);
  // The same with `read`, called whenever they are needed, from several threads at once.
  void SetReader(int picture, std::function<CarriedColor()> read);
  // Carries the colours of `sources` into the other pictures, then, in two more rounds, those of
  // the eight pictures that were reached best into the rest. `on_round` receives the number of
  // pictures that are to be reached. Throws Error{kCancelled}.
  void Run(std::vector<int> sources, const std::function<void(size_t pictures)>& on_round);
  // Of the picture's working size; confidence 0 where nothing is known.
  CarriedColor ColorOf(int picture) const;

 private:
  struct Known {
    std::function<CarriedColor()> read;  // empty: nothing is known
    double reached = 0.0;                // share of the picture, 0..1
  };

  // For each of `targets`, those of `sources` that have most local features in common with it.
  std::vector<std::vector<int>> NearestSources(const std::vector<int>& targets,
                                               const std::vector<int>& sources) const;
  void CarryInto(const std::vector<int>& targets, const std::vector<int>& sources);

  const ViewImages& images_;
  int channels_;
  const FilmCarryOptions& options_;
  StageContext& context_;
  int side_px_ = 1;           // longest of all pictures
  std::vector<Known> known_;  // by picture
};

}  // namespace color3d
