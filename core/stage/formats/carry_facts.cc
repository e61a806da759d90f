#include "core/stage/formats/carry_facts.h"

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/catalogue/stages.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

using nlohmann::ordered_json;

CarryFacts ReadCarryFacts(const StageContext& context) {
  CarryFacts facts;
  if (!context.HasInput(artifact::kCarryFacts)) return facts;
  try {
    const auto json = ordered_json::parse(context.ReadInput(artifact::kCarryFacts));
    if (json.contains("coverage")) facts.coverage = json.at("coverage").get<double>();
    if (json.contains("key_views")) json.at("key_views").get_to(facts.key_views);
    if (json.contains("views")) {
      for (const ordered_json& view : json.at("views")) {
        facts.view_coverage[view.at("view").get<std::string>()] = view.at("coverage").get<double>();
      }
    }
  } catch (const ordered_json::exception& e) {
    throw InvalidArgument(
        "{} is damaged: {}; run {} again", artifact::kCarryFacts, e.what(), kind::kCarryColor);
  }
  return facts;
}

void WriteCarryFacts(const CarryFacts& facts, StageContext& context) {
  ordered_json json{{"key_views", facts.key_views}};
  for (const auto& [view, coverage] : facts.view_coverage) {
    json["views"].push_back({{"view", view}, {"coverage", coverage}});
  }
  if (facts.coverage) json["coverage"] = *facts.coverage;
  context.WriteOutput(artifact::kCarryFacts, json.dump(1) + "\n");
}

}  // namespace color3d
