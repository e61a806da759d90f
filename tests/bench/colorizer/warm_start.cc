#include "tests/bench/colorizer/warm_start.h"

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/colorizer/archive.h"
#include "core/colorizer/options_json.h"

namespace color3d {
namespace {

// As core/colorizer/training_session.cc writes them.
constexpr char kMagic[] = "C3DCKPT1";
constexpr uint32_t kVersion = 2;

}  // namespace

std::string WarmStartState(const std::string& own,
                           const std::string& other,
                           const ColorizerOptions& options) {
  const Archive mine = ReadArchive(own, kMagic, kVersion, "this scene's network");
  Archive network = ReadArchive(other, kMagic, kVersion, "the other scene's network");
  try {
    auto header = nlohmann::json::parse(mine.header);
    const auto trained = nlohmann::json::parse(network.header);
    if (header.at("encoder") != trained.at("encoder")) {
      throw InvalidArgument("the other scene's network was trained on another encoder");
    }
    header["options"] = JsonFromOptions(options);
    for (const char* name : {"iteration", "steps", "rollbacks"}) header[name] = 0;
    for (const char* name : {"seconds", "running_loss", "best_running_loss"}) header[name] = 0.0;
    header["learning_rate_scale"] = 1.0;
    header["stopped_early"] = false;
    header["curve"] = nlohmann::json::array();
    network.header = header.dump();
  } catch (const nlohmann::json::exception& e) {
    throw InvalidArgument(std::string("a network to start from has a damaged header: ") + e.what());
  }
  // Adam knows nothing yet; with no steps behind it, the running mean of the parameters is
  // forgotten at once.
  for (auto& [name, array] : network.arrays) {
    if (name.starts_with("m.") || name.starts_with("v."))
      array.bytes.assign(array.bytes.size(), '\0');
  }
  return WriteArchive(network, kMagic);
}

}  // namespace color3d
