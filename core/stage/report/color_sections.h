// Chapters of the report on the colour of all views: its sources, the agreement of the views, the
// personalized colorizer. For the report stage only.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/carry/confidence.h"
#include "core/catalogue/metrics.h"
#include "core/report/report_page.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/report/next_key_view.h"

namespace color3d {

// Mean shares of the sources of the colour over the pixels of a view, by ProvenancePlane. They sum
// to 1.
using SourceShares = std::array<double, kProvenancePlanes>;

// nullopt if the decoder was trained, or if that is unknown. `personalization`: the curves of that
// stage.
std::optional<UntrainedDecoder> FindUntrainedDecoder(
    const std::vector<CurvePoint>& personalization);

// Read once from provenance/*, carry.json and scores.json, each of which may be absent. Not
// thread-safe.
class ColorFacts {
 public:
  // `next`: the view to colour next. Throws Error{kInvalidArgument} if an artifact is damaged.
  ColorFacts(const Scene& scene,
             StageContext& context,
             std::optional<NextKeyViewFacts> next = std::nullopt);

  // For metrics.json, in the order in which it is read: coverage, share_* over all views and
  // share_*_scored over the scored ones, the errors by source, agreement and steadiness.
  std::vector<std::pair<std::string, double>> Metrics() const;
  // Pictures beside the key views that the colorizer was trained on: "augment/a.png",
  // "outpaint-1 (embedded)".
  const std::vector<std::string>& augmentations() const { return augmentations_; }
  // `personalization`: the curves of that stage. Empty chapters are left out.
  std::vector<ReportSection> Sections(std::vector<CurvePoint> personalization) const;

 private:
  struct ViewFacts {
    int view = 0;
    bool scored = false;
    SourceShares shares = {};
  };
  // The metrics of one kind of picture: a row of a table.
  struct Agreement {
    std::string pictures;  // "rendered", "colored_views", "bound" or "truth"
    std::string label;
    std::map<std::string, double> figures;  // by key
  };

  void ReadProvenance();
  void ReadScores();
  void ReadAugmentations();
  SourceShares MeanShares(bool scored_only) const;
  // Adds a row to `rows` for each kind of picture in `found`.
  static void AddRows(const nlohmann::ordered_json& found, std::vector<Agreement>* rows);
  static ReportTable TableOf(MetricTable which, const std::vector<Agreement>& rows);
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
  std::vector<Agreement> steadiness_;  // films and dynamic scenes only
  std::map<std::string, double> errors_by_source_;
};

}  // namespace color3d
