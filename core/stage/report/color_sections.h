// The report's chapters about the colour of all views: where it comes from, whether the views
// agree, how the colorizer was personalized. For the report stage only.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/report/report_page.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/report/next_key_view.h"

namespace color3d {

// Mean shares of the colour's sources over a view's pixels; they sum to 1.
struct SourceShares {
  double guessed = 0.0;
  double seen = 0.0;
  double inferred = 0.0;
};

// Read once from provenance/*, carry.json and scores.json, each of which may be absent.
class ColorFacts {
 public:
  // `next`: the view to colour next. Throws Error{kInvalidArgument} when one of them is damaged.
  ColorFacts(const Scene& scene,
             StageContext& context,
             std::optional<NextKeyViewFacts> next = std::nullopt);

  // For metrics.json, in the order in which people read them: coverage, share_* over all views and
  // share_*_scored over those that are scored, me, tc, ... and the errors by source.
  std::vector<std::pair<std::string, double>> Metrics() const;
  // What the colorizer learnt from beside key views: "augment/a.png", "outpaint-1 (embedded)".
  const std::vector<std::string>& augmentations() const { return augmentations_; }
  // `personalization`: the curves of that stage. Chapters that would have nothing to tell are left
  // out.
  std::vector<ReportSection> Sections(std::vector<CurvePoint> personalization) const;

 private:
  struct ViewFacts {
    int view = 0;
    bool scored = false;
    SourceShares shares;
  };
  // A row of a table, e.g. "me", "me_de00", "tc_short", "tc_long", "tc".
  struct Agreement {
    std::string pictures;  // "rendered", "colored_views" or "truth"
    std::string what;      // in words
    std::map<std::string, double> figures;
  };

  void ReadProvenance();
  void ReadScores();
  void ReadAugmentations();
  SourceShares MeanShares(bool scored_only) const;
  // Adds a row to `rows` for each of the pictures that `found` has figures for.
  static void AddRows(const nlohmann::ordered_json& found,
                      const std::vector<const char*>& figures,
                      std::vector<Agreement>* rows);
  std::string SourceSummary() const;
  std::vector<ViewFacts> LeastCertainFirst() const;
  ReportTable ShareTable() const;
  ReportTable ErrorTable() const;
  std::vector<ReportRow> ProvenanceRows() const;
  ReportSection SourceSection() const;
  ReportSection AgreementSection() const;
  ReportSection SteadinessSection() const;
  ReportSection PersonalizationSection(std::vector<CurvePoint> curves) const;

  const Scene& scene_;
  StageContext& context_;
  std::vector<ViewFacts> views_;
  CarryFacts carry_;
  std::optional<NextKeyViewFacts> next_;
  std::vector<std::string> augmentations_;
  std::vector<Agreement> agreement_;
  std::vector<Agreement> steadiness_;  // of a film or of a scene that moves
  std::map<std::string, double> errors_by_source_;
};

}  // namespace color3d
