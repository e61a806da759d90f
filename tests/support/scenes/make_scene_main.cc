// color3d-make-scene OUT: writes the procedural room, for the demo and for experiments.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <map>
#include <string>

#include "tests/support/scenes/procedural_scene.h"

int main(int argc, char** argv) {
  using Poses = color3d::ProceduralSceneOptions::Poses;
  color3d::ProceduralSceneOptions options;
  std::string out;
  CLI::App app("Render a small furnished room as photos with known cameras.");
  app.add_option("OUT", out, "Folder for images/ and the poses")->required();
  app.add_option("--views", options.views, "Number of photos")->capture_default_str();
  app.add_option("--width", options.width, "Width of the photos, px")->capture_default_str();
  app.add_option("--height", options.height, "Height of the photos, px")->capture_default_str();
  app.add_option("--seed", options.seed, "Seed of furniture and textures")->capture_default_str();
  app.add_flag("--gray", options.gray, "Write monochrome photos, and colour ones to truth/");
  app.add_flag("--jpeg", options.jpeg, "Write JPEG instead of PNG");
  app.add_option("--poses", options.poses, "Poses to write: colmap, transforms or none")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Poses>{
          {"colmap", Poses::kColmap}, {"transforms", Poses::kTransforms}, {"none", Poses::kNone}}));
  CLI11_PARSE(app, argc, argv);
  try {
    color3d::WriteProceduralScene(out, options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "color3d-make-scene: %s\n", e.what());
    return 1;
  }
  return 0;
}
