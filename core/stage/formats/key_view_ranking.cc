#include "core/stage/formats/key_view_ranking.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/image/codec.h"
#include "core/report/contact_sheet.h"

namespace color3d {
namespace {

constexpr size_t kMaxRanked = 40;
constexpr size_t kMaxSetAside = 20;
constexpr int kSheetQuality = 88;
// Of KeyViewSelection::decisiveness.
constexpr double kTie = 0.05;
constexpr double kNarrow = 0.25;

std::string Views(size_t count) {
  return fmt::format("{} {}", count, count == 1 ? "view" : "views");
}

Image Thumbnail(const KeyViewRanking& ranking, int index) {
  if (ranking.features.empty()) return {};
  return DecodeImage(ranking.features[index].thumbnail, ranking.names[index]);
}

}  // namespace

std::string StrategyInWords(const std::string& strategy) {
  if (strategy == "coverage") return "feature coverage";
  if (strategy == "entropy") return "the entropy of its similarities";
  if (strategy == "tracks") return "the sparse points that it shares with other views";
  return "the strategy " + strategy;
}

std::string DescribeKeyView(const KeyViewRanking& ranking) {
  const auto& ranked = ranking.selection.ranking;
  if (!ranking.together.empty()) {
    std::string names;
    for (const int view : ranking.together) {
      names += (names.empty() ? "" : ", ") + ranking.names[view];
    }
    return fmt::format(
        "Chosen together: {}; the colour error (CIEDE2000) that is expected of all views falls "
        "from "
        "{:.1f} with the first to {:.1f}.",
        names,
        ranking.expected_error.front(),
        ranking.expected_error.back());
  }
  if (ranking.strategy == "manual") return "Chosen by the user.";
  const size_t kept = static_cast<size_t>(
      std::ranges::count_if(ranked, [](const RankedView& view) { return view.set_aside.empty(); }));
  std::string text;
  if (kept < 2) {
    text = "The only view that can be coloured.";
  } else if (!ranking.among.empty()) {
    text = fmt::format("Best of {} by {}.", ranking.among, StrategyInWords(ranking.strategy));
  } else {
    const double margin = ranking.selection.decisiveness;
    text = fmt::format("Best of {} by {}, {} {}.",
                       Views(kept),
                       StrategyInWords(ranking.strategy),
                       margin < kTie      ? "practically tied with"
                       : margin < kNarrow ? "narrowly ahead of"
                                          : "clearly ahead of",
                       ranking.names[ranked[1].index]);
  }
  if (kept < ranked.size()) text += " " + Views(ranked.size() - kept) + " set aside.";
  if (!ranking.fallback.empty()) text += " " + ranking.fallback;
  return text;
}

std::string KeyViewToJson(const KeyViewRanking& ranking) {
  nlohmann::ordered_json json{{"view", ranking.Chosen()},
                              {"strategy", ranking.strategy},
                              {"margin", ranking.selection.margin},
                              {"decisiveness", ranking.selection.decisiveness},
                              {"description", DescribeKeyView(ranking)}};
  for (size_t i = 0; i < ranking.together.size(); ++i) {
    json["key_views"].push_back({{"view", ranking.names[ranking.together[i]]},
                                 {"expected_error", ranking.expected_error[i]}});
  }
  if (!ranking.fallback.empty()) json["fallback"] = ranking.fallback;
  if (!ranking.encoder.empty()) json["encoder"] = ranking.encoder;
  for (const RankedView& ranked : ranking.selection.ranking) {
    json["ranking"].push_back({{"view", ranking.names[ranked.index]},
                               {"score", ranked.score},
                               {"mean_similarity", ranked.mean_similarity},
                               {"set_aside", !ranked.set_aside.empty()},
                               {"reason", ranked.set_aside}});
  }
  return json.dump(1) + "\n";
}

std::string KeyViewSheetJpeg(const KeyViewRanking& ranking, const Image& chosen_thumbnail) {
  ContactSheet sheet;
  sheet.title = "Key view: " + ranking.Chosen();
  sheet.subtitle = DescribeKeyView(ranking);
  for (const RankedView& ranked : ranking.selection.ranking) {
    const bool aside = !ranked.set_aside.empty();
    std::vector<SheetView>& list = aside ? sheet.set_aside : sheet.ranked;
    if (list.size() >= (aside ? kMaxSetAside : kMaxRanked)) {
      ++(aside ? sheet.set_aside_left_out : sheet.ranked_left_out);
      continue;
    }
    const bool chosen = ranked.index == ranking.selection.index ||
                        std::ranges::find(ranking.together, ranked.index) != ranking.together.end();
    Image thumbnail = Thumbnail(ranking, ranked.index);
    if (thumbnail.Empty() && chosen) thumbnail = chosen_thumbnail;
    const std::string note = aside ? ranked.set_aside
                             : ranking.strategy == "manual"
                                 ? "chosen by the user"
                                 : fmt::format("score {:.6g}", ranked.score);
    list.push_back({std::move(thumbnail), ranking.names[ranked.index], note, chosen});
  }
  return EncodeJpeg(DrawContactSheet(sheet), kSheetQuality);
}

}  // namespace color3d
