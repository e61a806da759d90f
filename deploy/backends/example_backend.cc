// color3d-example-backend: the smallest useful model server (color3d.backend.v1.ColorBackend). It
// colours by luminance and height, as hand-tinted postcards were: warm shadows, green below, blue
// above, and outpaints by mirroring. Replace Tint() and Outpaint() by models of your own;
// everything else can stay.
//   color3d-example-backend --listen 127.0.0.1:50661
//   color3d-server serve --backend example=127.0.0.1:50661 ...
//   color3d colorize PHOTOS --backend example -o OUT
#include <grpcpp/grpcpp.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "color3d/backend/v1/backend.grpc.pb.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

using backend::v1::ColorizeRequest;
using backend::v1::ColorizeUpdate;
using backend::v1::GenerateRequest;
using backend::v1::GenerateUpdate;

constexpr int64_t kMaxPixels = 50'000'000;

struct Chroma {
  double a = 0.0;
  double b = 0.0;
};

Chroma Mix(const Chroma& first, const Chroma& second, double share) {
  return {first.a + share * (second.a - first.a), first.b + share * (second.b - first.b)};
}

// Stand-in for a model. `height`: 0 at the top of the picture, 1 at the bottom.
Chroma Tint(double luminance, double height) {
  const Chroma sky{-4.0, -26.0}, foliage{-16.0, 22.0}, shadow{9.0, 13.0};
  const Chroma lit = Mix(sky, foliage, 1.0 / (1.0 + std::exp(-12.0 * (height - 0.5))));
  return Mix(shadow, lit, std::clamp(luminance / 60.0, 0.0, 1.0));
}

struct Point {
  double x = 0.0;
  double y = 0.0;
  Chroma chroma;
};

Point ReadPoint(const backend::v1::ColorPoint& point) {
  const std::string& text = point.color();
  const bool hex = text.size() == 7 && text[0] == '#' &&
                   text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
  if (!hex) throw InvalidArgument("the color '" + text + "' is not like #a0522d");
  const unsigned long value = std::stoul(text.substr(1), nullptr, 16);
  const LabColor lab = LabFromSrgb(RgbColor{static_cast<double>(value >> 16 & 255) / 255.0,
                                            static_cast<double>(value >> 8 & 255) / 255.0,
                                            static_cast<double>(value & 255) / 255.0});
  return {point.x(), point.y(), {lab.a, lab.b}};
}

// The nearest point's colour, or the tint where there are no points.
Chroma ColorAt(const std::vector<Point>& points, const Image& l, int x, int y) {
  if (points.empty()) return Tint(l.At(0, y, x), static_cast<double>(y) / l.height);
  const auto distance = [&](const Point& p) { return std::hypot(p.x - x, p.y - y); };
  return std::min_element(points.begin(),
                          points.end(),
                          [&](const Point& p, const Point& q) { return distance(p) < distance(q); })
      ->chroma;
}

// `report(progress)` returns false when the caller has gone.
template <typename Report>
std::string Colorize(const ColorizeRequest& request, Report report) {
  const Image l = LuminanceFromSrgb(DecodeImage(request.image(), "the photo"));
  Image mask(l.width, l.height, 1, 100.0f);
  if (!request.mask().empty()) {
    mask = Resize(LuminanceFromSrgb(DecodeImage(request.mask(), "the mask")), l.width, l.height);
  }
  std::vector<Point> points;
  for (const auto& point : request.points()) points.push_back(ReadPoint(point));
  Image ab(l.width, l.height, 2);
  for (int y = 0; y < l.height; ++y) {
    if (y % 64 == 0 && !report(static_cast<double>(y) / l.height)) return "";
    for (int x = 0; x < l.width; ++x) {
      const Chroma chroma = ColorAt(points, l, x, y);
      ab.At(0, y, x) = static_cast<float>(chroma.a * mask.At(0, y, x) / 100.0);
      ab.At(1, y, x) = static_cast<float>(chroma.b * mask.At(0, y, x) / 100.0);
    }
  }
  return EncodePng8(SrgbFromLab(JoinLab(l, ab)));
}

// Stand-in for a generator: the picture at half its size in one corner of the canvas,
// mirrored beyond its two outer sides.
Image Outpaint(const Image& srgb, int corner) {
  const Image part = Resize(srgb, (srgb.width + 1) / 2, (srgb.height + 1) / 2);
  const auto mirrored = [](int i, int side) {
    return i < side ? i : std::max(0, 2 * side - 1 - i);
  };
  Image canvas(srgb.width, srgb.height, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < canvas.height; ++y) {
      for (int x = 0; x < canvas.width; ++x) {
        const int from_x = mirrored(corner % 2 == 0 ? x : canvas.width - 1 - x, part.width);
        const int from_y = mirrored(corner / 2 == 0 ? y : canvas.height - 1 - y, part.height);
        canvas.At(c, y, x) = part.At(c,
                                     corner / 2 == 0 ? from_y : part.height - 1 - from_y,
                                     corner % 2 == 0 ? from_x : part.width - 1 - from_x);
      }
    }
  }
  return canvas;
}

class ExampleBackend : public backend::v1::ColorBackend::Service {
 public:
  explicit ExampleBackend(int delay_ms) : delay_ms_(delay_ms) {}

  grpc::Status GetInfo(grpc::ServerContext*,
                       const backend::v1::GetInfoRequest*,
                       backend::v1::BackendInfo* info) override {
    info->set_name("color3d-example-backend");
    info->set_version("1");
    info->set_license("Apache-2.0");
    info->add_capabilities(backend::v1::CAPABILITY_AUTOMATIC);
    info->add_capabilities(backend::v1::CAPABILITY_COLOR_POINTS);
    info->add_capabilities(backend::v1::CAPABILITY_MASK);
    info->add_capabilities(backend::v1::CAPABILITY_OUTPAINT);
    info->set_max_pixels(kMaxPixels);
    info->set_deterministic(true);
    info->set_ready(true);
    return grpc::Status::OK;
  }

  grpc::Status Colorize(grpc::ServerContext* context,
                        const ColorizeRequest* request,
                        grpc::ServerWriter<ColorizeUpdate>* writer) override {
    ColorizeUpdate update;
    try {
      const std::string picture = color3d::Colorize(*request, [&](double progress) {
        std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms_));
        update.set_progress(progress);
        return !context->IsCancelled() && writer->Write(update);
      });
      if (picture.empty()) return grpc::Status::CANCELLED;
      update.set_image(picture);
      writer->Write(update);
      return grpc::Status::OK;
    } catch (const std::exception& e) {
      return {grpc::StatusCode::INVALID_ARGUMENT, e.what()};
    }
  }

  grpc::Status Generate(grpc::ServerContext* context,
                        const GenerateRequest* request,
                        grpc::ServerWriter<GenerateUpdate>* writer) override {
    if (request->kind() != backend::v1::CAPABILITY_OUTPAINT) {
      return {grpc::StatusCode::INVALID_ARGUMENT, "this server only outpaints"};
    }
    try {
      const Image srgb = DecodeImage(request->image(), "the key view");
      if (srgb.channels != 3) throw InvalidArgument("the key view is grey");
      for (int i = 0; i < request->samples(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms_));
        GenerateUpdate update;
        update.set_image(EncodePng8(Outpaint(srgb, i % 4)));
        if (context->IsCancelled() || !writer->Write(update)) return grpc::Status::CANCELLED;
      }
      return grpc::Status::OK;
    } catch (const std::exception& e) {
      return {grpc::StatusCode::INVALID_ARGUMENT, e.what()};
    }
  }

 private:
  const int delay_ms_;
};

int Main(int argc, char** argv) {
  std::string listen = "127.0.0.1:50661";
  std::string port_file;
  int delay_ms = 0;
  CLI::App app(
      "A model server for color3d that needs no model: an example to begin one's own from.");
  app.add_option("--listen", listen, "HOST:PORT (port 0: any free one) or unix:PATH")
      ->capture_default_str();
  app.add_option("--port-file", port_file, "Write the address here once it is bound");
  app.add_option("--delay-ms", delay_ms, "Be as slow as a model: wait before each 64 rows")
      ->check(CLI::Range(0, 600'000));
  CLI11_PARSE(app, argc, argv);
  // Stop signals end the process: a request that is lost is asked again.
  ::signal(SIGPIPE, SIG_IGN);
  ExampleBackend service(delay_ms);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(listen, grpc::InsecureServerCredentials(), &port);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.SetMaxReceiveMessageSize(256 << 20);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  if (!server) {
    std::cerr << "color3d-example-backend: cannot listen on " << listen
              << "; choose another address with --listen\n";
    return 2;
  }
  const std::string address = listen.starts_with("unix:")
                                  ? listen
                                  : listen.substr(0, listen.rfind(':') + 1) + std::to_string(port);
  if (!port_file.empty()) WriteFileAtomic(port_file, address + "\n");
  std::cout << "color3d-example-backend listens on " << address << std::endl;
  server->Wait();
  return 0;
}

}  // namespace
}  // namespace color3d

int main(int argc, char** argv) { return color3d::Main(argc, argv); }
