// The edited share of a recoloured view: the fourth channel of its ab map (codec.h), 0 where the
// photo's own colours stay. Only the maps kKeyColor and kCarried of edits have it. Stateless.
#pragma once

#include <string>
#include <string_view>

#include "core/base/image.h"
#include "core/carry/carry.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d {

class StageContext;

// Adds the edited share (1 channel) as the third channel of an ab image of its size; does nothing
// if `share` is empty.
void AddEditedShare(const Image& share, Image* ab);

// EncodeAbPng with the edited share, the third channel of `color.ab`, if there is one.
std::string EncodeCarriedPng(const CarriedColor& color);

// Inverse of EncodeCarriedPng. Throws as DecodeAbPng.
CarriedColor DecodeCarriedPng(const std::string& png, const std::string& name);

// Edited share (1 channel, 0..1) of the ab map among the inputs, resized; empty if it has none or
// there is no such input. Weighted by the map's confidence.
Image ReadEditedShare(const StageContext& context, const std::string& name, int width, int height);

// Edited share of an additional key view, of the size of `images`. 1 everywhere if its colours are
// given in another way, because then they replace the photo's.
Image ReadAdditionalEditedShare(const StageContext& context,
                                const Scene& scene,
                                int view,
                                const ViewImages& images);

}  // namespace color3d
