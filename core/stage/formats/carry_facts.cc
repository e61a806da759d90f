#include "core/stage/formats/carry_facts.h"

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/catalogue/stages.h"
#include "core/stage/formats/artifacts.h"

namespace color3d {

using nlohmann::ordered_json;

CarryFacts ReadCarryFacts(const StageContext& context) {
  CarryFacts facts;
  if (!context.HasInput(artifact::kCarryFacts)) return facts;
  try {
    const auto json = ordered_json::parse(context.ReadInput(artifact::kCarryFacts));
    if (json.contains("coverage")) facts.coverage = json.at("coverage").get<double>();
    if (json.contains("key_views")) json.at("key_views").get_to(facts.key_views);
  } catch (const ordered_json::exception& e) {
    throw InvalidArgument(
        "{} is damaged: {}; run {} again", artifact::kCarryFacts, e.what(), kind::kCarryColor);
  }
  return facts;
}

void WriteCarryFacts(const CarryFacts& facts,
                     const Scene& scene,
                     const std::vector<double>& coverage,
                     StageContext& context) {
  ordered_json json{{"key_views", facts.key_views}};
  for (size_t i = 0; i < coverage.size(); ++i) {
    json["views"].push_back({{"view", scene.views[i].name}, {"coverage", coverage[i]}});
  }
  if (facts.coverage) json["coverage"] = *facts.coverage;
  context.WriteOutput(artifact::kCarryFacts, json.dump(1) + "\n");
}

}  // namespace color3d
