#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {

void RunPersonalize(const ColorizerOptions& options,
                    StageContext& context,
                    const std::string& encoder) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const ViewImages images(scene, context.scene_folder(), options.max_side_px, 0);
  const auto luminance = images.Luminance(key);
  const AbMap color = DecodeAbPng(context.ReadInput(artifact::kKeyColor), artifact::kKeyColor);
  const Image ab = Resize(color.ab, luminance->width, luminance->height);
  const auto colorizer = TrainColorizer(context.LoadEncoder(encoder),
                                        {{"the key view", *luminance, ab}},
                                        options,
                                        context.checkpoints(),
                                        context.progress(),
                                        context.cancel());
  context.WriteOutput(artifact::kColorizer, colorizer->Serialize());
}

}  // namespace color3d
