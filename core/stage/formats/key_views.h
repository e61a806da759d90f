// Key views and their colours among the inputs of a stage. Stateless.
#pragma once

#include <string>
#include <vector>

#include "core/carry/carry.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d {

class StageContext;

// Index of an additional key view by its name. Throws Error: what Scene::FindView throws,
// kInvalidArgument when the view is held out.
int FindAdditionalKeyView(const Scene& scene, const std::string& name);

// Indices of the chosen key view and of the `additional` ones, in this order. Throws Error: what
// ReadKeyView and FindAdditionalKeyView throw, kInvalidArgument when a view is named twice.
std::vector<int> ReadKeyViews(const StageContext& context,
                              const Scene& scene,
                              const std::vector<std::string>& additional);

// Folders among the inputs with the artifacts of an additional key view each, in the order in which
// the key views were given. They end in "/".
std::vector<std::string> AdditionalKeyViewFolders(const StageContext& context);

// Names of these key views, in the same order.
std::vector<std::string> AdditionalKeyViewNames(const StageContext& context);
// Folder of the additional key view. Throws Error{kFailedPrecondition} when no input has its
// colours.
std::string AdditionalKeyViewFolder(const StageContext& context, const Scene& scene, int view);

// Colours of an additional key view, of the size of `images`. Their confidence is 0 where the view
// is not painted or is masked out. Throws as AdditionalKeyViewFolder.
CarriedColor ReadAdditionalKeyColor(const StageContext& context,
                                    const Scene& scene,
                                    int view,
                                    const ViewImages& images);

}  // namespace color3d
