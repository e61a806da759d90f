// color3d-bench carry: key-view chroma carried into the held-out views of a finished pipeline, and
// its error by confidence.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/carry/carry.h"
#include "core/carry/plane_sweep.h"
#include "core/carry/stereo_views.h"
#include "core/color/difference.h"
#include "core/colorizer/colorizer.h"
#include "core/keycolor/automatic.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/keycolor/edge_weights.h"
#include "core/keycolor/grid_solver.h"
#include "core/scene/view_images.h"
#include "core/splat/render.h"
#include "core/stage/artifacts.h"
#include "tests/bench/commands.h"

namespace color3d {
namespace {

struct CarryArguments {
  std::string scene_folder;
  std::string run_folder;
  std::string out_folder;
  int side_px = 500;
  int sweep_px = 400;
  int sources = 4;
  double power = 0, scale = 1, fuse_sigma = 1.0, prior = 0.02, weight = 1.0, low = 0.03;
  bool sweep = true;
  bool sweep_only = false;
  CarryOptions options;
  PlaneSweepOptions sweep_options;
};

Image Lerp(const Image& from, const Image& to, const Image& share) {
  Image out = from;
  for (int c = 0; c < out.channels; ++c)
    for (size_t i = 0; i < out.PlaneSize(); ++i)
      out.Plane(c)[i] += share.data[i] * (to.Plane(c)[i] - out.Plane(c)[i]);
  return out;
}

Image Fuse(const Image& l, const Image& prior, const Image& carried, const Image& conf, double sigma,
           double prior_weight, double carried_weight, double low, ThreadPool& pool,
           const Image& distance = {}, double power = 0, double scale = 1) {
  GridSystem system = SystemOfLuminance(l, sigma, pool);
  const size_t n = l.PlaneSize();
  std::vector<float> target(2 * n);
  for (size_t i = 0; i < n; ++i) {
    const float c = std::max(0.0, (conf.data[i] - low)) * carried_weight;
    const float p = prior_weight / (distance.Empty() ? 1.0 : 1.0 + std::pow(distance.data[i] / scale, power));
    system.data[i] = c + p;
    for (int k = 0; k < 2; ++k)
      target[k * n + i] = (c * carried.Plane(k)[i] + p * prior.Plane(k)[i]) / (c + p);
  }
  CancellationToken cancel;
  GridSolveOptions o; o.tolerance = 1e-3;
  const GridSolution s = SolveGridSystem(std::move(system), target, o, pool, [](int, double) {}, cancel);
  Image out(l.width, l.height, 2);
  out.data = s.u;
  return out;
}

void RunCarry(const CarryArguments& args) {
  const std::filesystem::path run = args.run_folder;
  const Scene scene = SceneFromJson(ReadFile(run / artifact::kScene));
  const GaussianModel model = ParseGaussians(ReadFile(run / artifact::kModel));
  const auto key_json = nlohmann::json::parse(ReadFile(run / artifact::kKeyView));
  const int key = scene.FindView(key_json.at("view").get<std::string>());
  const ViewImages images(scene, args.scene_folder, args.side_px);
  ThreadPool pool(2);
  const auto surface = [&](int v, Image* rendered_ab) {
    const Camera camera = images.WorkingCamera(v);
    const RenderedView r = RenderView(model, camera, scene.views[v].cam_from_world, pool);
    SurfaceView s{camera, scene.views[v].cam_from_world, *images.Luminance(v), r.depth};
    for (size_t i = 0; i < s.depth.data.size(); ++i)
      if (r.opacity.data[i] < 0.5f) s.depth.data[i] = 0.0f;
    if (rendered_ab) *rendered_ab = ChromaOfLab(r.lab);
    return s;
  };
  const ViewImages small(scene, args.scene_folder, args.sweep_px);
  CancellationToken cancel;
  double sweep_seconds = 0;
  const auto swept = [&](int v, SurfaceView s) {
    std::vector<Eigen::Vector3d> points;
    for (const SparsePoint& p : scene.points)
      if (std::find(p.views.begin(), p.views.end(), v) != p.views.end()) points.push_back(p.position);
    if (points.size() < 30) {
      for (int y = 8; y < s.camera.height; y += 16)
        for (int x = 8; x < s.camera.width; x += 16) {
          const double d = s.depth.At(0, y, x);
          if (d <= 0) continue;
          const Eigen::Vector3d c(d * (x + 0.5 - s.camera.cx) / s.camera.fx,
                                  d * (y + 0.5 - s.camera.cy) / s.camera.fy, d);
          points.push_back(s.cam_from_world.Center() + s.cam_from_world.rotation.conjugate() * c);
        }
    }
    const StereoPlan plan = PlanStereo(scene, v, points, scene.TrainingViews(), args.sources);
    const auto posed = [&](int i) {
      return PosedLuminance{small.WorkingCamera(i), scene.views[i].cam_from_world,
                            small.Luminance(i).get()};
    };
    std::vector<PosedLuminance> sources;
    std::string names;
    for (int i : plan.sources) { sources.push_back(posed(i)); names += " " + scene.views[i].name; }
    const auto start = std::chrono::steady_clock::now();
    const std::filesystem::path cached = run / ("depth." + std::to_string(args.sweep_px) + "." + std::to_string(args.sources) + "." + std::to_string(args.sweep_options.planes) + "." + std::to_string(args.sweep_options.large_step) + "." + std::to_string(args.sweep_options.small_step) + "." + std::to_string(v) + ".bin");
    if (std::filesystem::exists(cached)) {
      const std::string bytes = ReadFile(cached);
      std::memcpy(s.depth.data.data(), bytes.data(), bytes.size());
      return s;
    }
    const DepthMap map = SweepPlanes(posed(v), sources, plan.nearest, plan.farthest, args.sweep_options, cancel);
    sweep_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    s.depth = Resize(map.depth, s.camera.width, s.camera.height);
    WriteFileAtomic(cached, {reinterpret_cast<const char*>(s.depth.data.data()), s.depth.data.size() * 4});
    std::fprintf(stderr, "%s: %zu points, %.3g..%.3g from%s\n", scene.views[v].name.c_str(), points.size(), plan.nearest, plan.farthest, names.c_str());
    if (!args.out_folder.empty()) {
      Image d = map.depth;
      for (float& z : d.data) z = static_cast<float>((1 / z - 1 / plan.farthest) / (1 / plan.nearest - 1 / plan.farthest));
      std::filesystem::create_directories(args.out_folder);
      WriteFileAtomic(std::filesystem::path(args.out_folder) / (std::filesystem::path(scene.views[v].name).stem().string() + ".depth.png"), EncodePng8(d));
    }
    return s;
  };
  const SurfaceView source = surface(key, nullptr);
  const SurfaceView swept_source = args.sweep ? swept(key, source) : source;
  const AbMap color = DecodeAbPng(ReadFile(run / artifact::kKeyColor), "key");
  const Image key_ab = Resize(color.ab, source.camera.width, source.camera.height);
  const auto encoder = Encoder::Embedded();
  const auto colorizer = LoadColorizer(ReadFile(run / artifact::kColorizer), encoder, 2);
  const auto automatic = AutomaticColorizer::Embedded();
  const double dedges[8] = {0, 0.7, 1.0, 1.5, 2.0, 3.0, 4.5, 100};
  double derr[7][4] = {}, dcount[7] = {};
  constexpr int kBins = 6;
  const double edges[kBins + 1] = {-1, 0.05, 0.2, 0.4, 0.6, 0.8, 1.01};
  double error[kBins][3] = {}, count[kBins] = {};
  double fuse_seconds = 0, total[6] = {};
  int views = 0;
  for (int v : scene.HeldOutViews()) {
    Image rendered_ab;
    const SurfaceView target = surface(v, &rendered_ab);
    CarriedColor carried = CarryColor(source, key_ab, {}, target, args.options);
    if (args.sweep) {
      const CarriedColor other = CarryColor(swept_source, key_ab, {}, swept(v, target), args.options);
      if (args.sweep_only) carried = other;
      else
      for (size_t i = 0; i < carried.confidence.data.size(); ++i)
        if (other.confidence.data[i] > carried.confidence.data[i]) {
          carried.confidence.data[i] = other.confidence.data[i];
          for (int c = 0; c < 2; ++c) carried.ab.Plane(c)[i] = other.ab.Plane(c)[i];
        }
    }
    const Image truth = LabFromSrgb(images.Srgb(v));
    const std::string name = ViewArtifact(artifact::kViewsAb, scene.views[v], ".png");
    const Image direct = Resize(DecodeAbPng(ReadFile(run / name), name).ab, truth.width, truth.height);
    Image share = carried.confidence;
    for (float& w : share.data) w = std::min(1.0f, std::max(0.0f, (w - 0.03f) / 0.15f));
    const Image fused = Lerp(direct, carried.ab, share);
    const Image fused3 = Lerp(rendered_ab, carried.ab, share);
    const Image l = LuminanceOfLab(truth);
    const auto t0 = std::chrono::steady_clock::now();
    const ColorPrediction predicted = colorizer->Predict(l);
    const Image solved = Fuse(l, direct, carried.ab, carried.confidence, args.fuse_sigma, args.prior, args.weight, args.low, pool, args.power > 0 ? predicted.distance : Image(), args.power, args.scale);
    fuse_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count();
    const Image solved3 = Fuse(l, rendered_ab, carried.ab, carried.confidence, args.fuse_sigma, args.prior, args.weight, args.low, pool, args.power > 0 ? predicted.distance : Image(), args.power, args.scale);
    const Image* candidates[6] = {&direct, &rendered_ab, &fused, &fused3, &solved, &solved3};
    const Image small_truth = FitWithin(truth, 400);
    double row[6];
    for (int i = 0; i < 6; ++i) {
      row[i] = MeanDeltaE00(FitWithin(JoinLab(l, *candidates[i]), 400), small_truth);
      total[i] += row[i];
    }
    {
      const ColorPrediction pred = colorizer->Predict(l);
      const AutomaticColor guess = automatic->Colorize(l);
      for (size_t i = 0; i < truth.PlaneSize(); ++i) {
        if (carried.confidence.data[i] > 0.1) continue;
        int b = 0;
        while (pred.distance.data[i] >= dedges[b + 1]) ++b;
        const LabColor t{truth.Plane(0)[i], truth.Plane(1)[i], truth.Plane(2)[i]};
        const auto e = [&](const Image& ab, float f) {
          return DeltaE00({t.l, f * ab.Plane(0)[i], f * ab.Plane(1)[i]}, t);
        };
        derr[b][0] += e(pred.ab, 1);
        derr[b][1] += e(guess.ab, 1);
        derr[b][2] += e(guess.ab, 0);
        derr[b][3] += DeltaE00({t.l, 0.5f * (pred.ab.Plane(0)[i] + guess.ab.Plane(0)[i]), 0.5f * (pred.ab.Plane(1)[i] + guess.ab.Plane(1)[i])}, t);
        dcount[b] += 1;
      }
    }
    ++views;
    double covered = 0;
    for (size_t i = 0; i < truth.PlaneSize(); ++i) {
      const float c = carried.confidence.data[i];
      covered += c > 0.5f;
      int bin = 0;
      while (c >= edges[bin + 1]) ++bin;
      const LabColor t{truth.Plane(0)[i], truth.Plane(1)[i], truth.Plane(2)[i]};
      const auto e = [&](const Image& ab) {
        return DeltaE00({t.l, ab.Plane(0)[i], ab.Plane(1)[i]}, t);
      };
      error[bin][0] += e(carried.ab);
      error[bin][1] += e(direct);
      error[bin][2] += e(rendered_ab);
      count[bin] += 1;
    }
    std::printf("%-24s covered %.3f  2d %.2f rendered %.2f fused %.2f fused3d %.2f solved %.2f solved3d %.2f\n",
                scene.views[v].name.c_str(), covered / truth.PlaneSize(), row[0], row[1], row[2],
                row[3], row[4], row[5]);
    if (!args.out_folder.empty()) {
      const std::filesystem::path out = args.out_folder;
      std::filesystem::create_directories(out);
      const std::string stem = std::filesystem::path(scene.views[v].name).stem();
      WriteFileAtomic(out / (stem + ".fused.png"), EncodePng8(SrgbFromLab(JoinLab(l, solved))));
      WriteFileAtomic(out / (stem + ".true.png"), EncodePng8(SrgbFromLab(truth)));
      WriteFileAtomic(out / (stem + ".carried.png"), EncodePng8(SrgbFromLab(JoinLab(l, carried.ab))));
      WriteFileAtomic(out / (stem + ".conf.png"), EncodePng8(carried.confidence));
      WriteFileAtomic(out / (stem + ".2d.png"), EncodePng8(SrgbFromLab(JoinLab(l, direct))));
    }
  }
  std::printf("key %s mean 2d %.3f rendered %.3f fused %.3f fused3d %.3f solved %.3f solved3d %.3f (%.1f s)\n",
              scene.views[key].name.c_str(), total[0] / views, total[1] / views, total[2] / views,
              total[3] / views, total[4] / views, total[5] / views, fuse_seconds);
  for (int b = 0; b < 7; ++b)
    std::printf("conf distance < %.2f pixels %.0f personal %.2f auto %.2f grey %.2f mean of both %.2f\n", dedges[b + 1], dcount[b], derr[b][0] / dcount[b], derr[b][1] / dcount[b], derr[b][2] / dcount[b], derr[b][3] / dcount[b]);
  std::printf("sweeping %.1f s\n", sweep_seconds);
  double all = 0;
  for (double c : count) all += c;
  for (int b = 0; b < kBins; ++b)
    std::printf("conf < %.2f share %.3f carried %.2f 2d %.2f rendered %.2f\n", edges[b + 1],
                count[b] / all, error[b][0] / count[b], error[b][1] / count[b],
                error[b][2] / count[b]);
}

}  // namespace

void AddCarryCommand(CLI::App& app) {
  auto args = std::make_shared<CarryArguments>();
  CLI::App* command = app.add_subcommand("carry", "carried chroma of a finished pipeline");
  command->add_option("--scene", args->scene_folder)->required();
  command->add_option("--run", args->run_folder, "output of color3d-bench pipeline")->required();
  command->add_option("--out", args->out_folder);
  command->add_option("--side", args->side_px);
  command->add_option("--depth-tolerance", args->options.depth_tolerance);
  command->add_option("--luminance-tolerance", args->options.luminance_tolerance);
  command->add_option("--flow-tolerance", args->options.flow_tolerance_px);
  command->add_option("--fuse-sigma", args->fuse_sigma);
  command->add_option("--power", args->power);
  command->add_option("--scale", args->scale);
  command->add_option("--prior", args->prior);
  command->add_option("--weight", args->weight);
  command->add_option("--low", args->low);
  command->add_option("--structure-tolerance", args->options.structure_tolerance);
  command->add_option("--sweep", args->sweep);
  command->add_option("--sweep-only", args->sweep_only);
  command->add_option("--sweep-px", args->sweep_px);
  command->add_option("--sources", args->sources);
  command->add_option("--planes", args->sweep_options.planes);
  command->add_option("--p1", args->sweep_options.small_step);
  command->add_option("--p2", args->sweep_options.large_step);
  command->callback([args] { RunCarry(*args); });
}

}  // namespace color3d
