// color3d-bench dynamic-scenes: writes a synthetic dynamic scene.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "tests/bench/commands.h"
#include "tests/support/scenes/dynamic_scene.h"

namespace color3d {
namespace {

struct DynamicScenesArguments {
  std::string out;
  std::string name = "sliding";
  int side = 128;
  DynamicSceneOptions options;
};

void RunDynamicScenes(DynamicScenesArguments args) {
  args.options.which = DynamicCaseFromName(args.name);
  args.options.width = args.side;
  args.options.height = args.side * 3 / 4;
  const DynamicScene scene(args.options);
  WriteDynamicScene(args.out, scene);
  std::printf("%s: %s, %d cameras, %d times, %d x %d px\n",
              args.out.c_str(),
              args.name.c_str(),
              scene.cameras(),
              scene.times(),
              args.options.width,
              args.options.height);
}

}  // namespace

void AddDynamicScenesCommand(CLI::App& app) {
  auto args = std::make_shared<DynamicScenesArguments>();
  CLI::App* command = app.add_subcommand(
      "dynamic-scenes", "Write a synthetic dynamic scene: colour pictures and transforms.json");
  std::vector<std::string> names;
  for (const DynamicCase each : DynamicCases()) names.push_back(DynamicCaseName(each));
  command->add_option("--out", args->out, "Folder for the scene")->required();
  command->add_option("--case", args->name, "Motion of the objects")
      ->check(CLI::IsMember(names))
      ->capture_default_str();
  command->add_option("--side", args->side, "Width of the pictures, px; the height is 3/4 of it")
      ->check(CLI::Range(22, 512))
      ->capture_default_str();
  command->add_option("--cameras", args->options.cameras, "Number of cameras")
      ->capture_default_str();
  command->add_option(
      "--times", args->options.times, "Number of time steps; 0: default of the case");
  command->add_flag("--moving-cameras", args->options.moving_cameras, "Move the cameras");
  command->add_option("--seed", args->options.seed, "Seed of furniture and textures")
      ->capture_default_str();
  command->callback([args] { RunDynamicScenes(*args); });
}

}  // namespace color3d
