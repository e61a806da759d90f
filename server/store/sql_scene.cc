// Scenes and colorizers.
#include <fmt/core.h>

#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"
#include "server/base/service_error.h"
#include "server/store/sql_database.h"
#include "server/store/sql_job_store.h"
#include "server/store/sql_rows.h"

namespace color3d {
SceneRecord SqlJobStore::RequireScene(SqlDatabase& db, const std::string& name, bool with_files) {
  SqlStatement select(db, SelectScene("where name=?"), name);
  if (!select.Step()) {
    throw ServiceError(ErrorReason::kSceneNotFound, "there is no scene '{}'", PublicScene(name));
  }
  SceneRecord scene = SceneFromRow(select);
  if (!with_files) return scene;
  scene.files =
      SqlStatement(db,
                   "select path, sha256, size_bytes from scene_file where scene_id=? order by path",
                   scene.id)
          .All([](const SqlStatement& row) {
            return SceneFileRecord{row.Text(0), {row.Text(1), row.Int(2)}};
          });
  return scene;
}

void SqlJobStore::RequireRoomForScene(SqlDatabase& db,
                                      const std::string& project,
                                      const SceneLimits& limits) {
  SqlStatement select(db, "select scenes, uncommitted from project where name=?", project);
  if (!select.Step()) return;
  const auto refuse = [&](const char* what, int64_t count, int64_t most, const char* remedy) {
    throw ServiceError(
        ErrorReason::kQuotaExceeded,
        fmt::format(
            "your project has {} {}, at most {} are allowed; {}", count, what, most, remedy),
        {{"project:" + project + " scenes", fmt::format("{} of {}", count, most)}});
  };
  if (select.Int(0) >= limits.all) {
    refuse("scenes", select.Int(0), limits.all, "delete unneeded scenes");
  }
  if (select.Int(1) >= limits.uncommitted) {
    refuse("scenes that are not committed",
           select.Int(1),
           limits.uncommitted,
           "commit or delete some of them");
  }
}

SceneRecord SqlJobStore::CreateScene(const SceneRecord& record,
                                     const RequestKey& request,
                                     const SceneLimits& limits) {
  return connections_->Write([&](SqlDatabase& db) -> SceneRecord {
    if (const auto resource = CheckRequest(db, request)) return RequireScene(db, *resource, true);
    if (SqlStatement(db, "select 1 from scene where name=?", record.name).Step()) {
      throw ServiceError(ErrorReason::kSceneExists,
                         "the scene '{}' exists; choose another scene_id",
                         PublicScene(record.name));
    }
    RequireRoomForScene(db, record.project, limits);
    SceneRecord fresh;
    fresh.row_bytes = RowBytes(record);
    fresh.name = record.name;
    fresh.project = record.project;
    fresh.display_name = record.display_name;
    fresh.create_ms = Now(db);
    const int64_t scene_id = InsertSceneRow(db, fresh);
    for (const SceneFileRecord& file : record.files) {
      db.Run("insert into scene_file(scene_id, path, sha256, size_bytes) values(?,?,?,?)",
             scene_id,
             file.path,
             file.digest.sha256,
             file.digest.size_bytes);
    }
    RecordRequest(db, request, record.name);
    SceneRecord scene = RequireScene(db, record.name, true);
    return scene;
  });
}

SceneRecord SqlJobStore::GetScene(const std::string& name) {
  return connections_->Read(
      [&](SqlDatabase& db) -> SceneRecord { return RequireScene(db, name, true); });
}

std::vector<SceneRecord> SqlJobStore::ListScenes(const std::optional<std::string>& project,
                                                 int64_t before_id,
                                                 int limit) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<SceneRecord> {
    std::string tail = "where scene_id < ?";
    if (project) tail += " and project=?";
    SqlStatement select(db,
                        SelectScene(tail + " order by scene_id desc limit ?"),
                        before_id > 0 ? before_id : INT64_MAX);
    if (project) select.Bind(*project);
    select.Bind(limit);
    return select.All(SceneFromRow);
  });
}

SceneRecord SqlJobStore::ActivateScene(const std::string& name,
                                       CaptureLayout layout,
                                       int photo_count,
                                       const RequestKey& request) {
  return connections_->Write([&](SqlDatabase& db) -> SceneRecord {
    if (const auto resource = CheckRequest(db, request)) return RequireScene(db, *resource, true);
    RequireScene(db, name, false);
    // A second activation changes nothing: the scene is immutable.
    db.Run(
        "update scene set active=1, layout=?, photo_count=?, commit_ms=? where name=? and "
        "active=0",
        static_cast<int>(layout),
        photo_count,
        Now(db),
        name);
    RecordRequest(db, request, name);
    SceneRecord scene = RequireScene(db, name, true);
    return scene;
  });
}

SceneRecord SqlJobStore::AcceptKeyColor(const std::string& name,
                                        const std::string& job,
                                        const RequestKey& request) {
  return connections_->Write([&](SqlDatabase& db) -> SceneRecord {
    if (const auto resource = CheckRequest(db, request)) return RequireScene(db, *resource, true);
    RequireScene(db, name, false);
    if (!job.empty()) {
      const JobRecord record = RequireJob(db, job);
      if (record.kind != kind::kColorizeKeyView || record.scene != name) {
        throw InvalidArgument("{} is a {} job of {}; give a {} job of {}",
                              job,
                              record.kind,
                              PublicScene(record.scene),
                              kind::kColorizeKeyView,
                              PublicScene(name));
      }
      if (record.state != JobState::kSucceeded) {
        throw ServiceError(ErrorReason::kWrongState,
                           "{} is {}; only a key view that has been coloured can be accepted",
                           job,
                           JobStateName(record.state));
      }
    }
    db.Run("update scene set key_color_job=? where name=?", job, name);
    RecordRequest(db, request, name);
    SceneRecord scene = RequireScene(db, name, true);
    return scene;
  });
}

void SqlJobStore::DeleteScene(const std::string& name, const RequestKey& request) {
  connections_->Write([&](SqlDatabase& db) {
    if (CheckRequest(db, request)) return;
    const SceneRecord scene = RequireScene(db, name, false);
    SqlStatement busy(db, "select name from job where scene=? and end_ms=0 limit 1", name);
    if (busy.Step()) {
      throw ServiceError(ErrorReason::kSceneInUse,
                         "{} of the scene '{}' is not finished; cancel it or wait for it",
                         busy.Text(0),
                         PublicScene(name));
    }
    const std::vector<std::string> files =
        SqlStatement(db, "select sha256 from scene_file where scene_id=?", scene.id).Texts();
    db.Run("delete from scene where scene_id=?", scene.id);
    ReleaseHoldings(db, scene.project, files);
    RecordRequest(db, request, name);
  });
}

namespace {

// Condition: the artifact is a colorizer of the project (?2, unless ?1) and scene (?3, unless
// empty).
std::string IsColorizer(const char* artifact, const char* job) {
  return fmt::format(
      "{0}.name='{2}' and {1}.kind='{3}' and {1}.state='SUCCEEDED' and (?1 or {1}.project=?2) and "
      "(?3='' or {1}.scene=?3)",
      artifact,
      job,
      artifact::kColorizer,
      FindProducer(artifact::kColorizer)->kind);
}

// Replaces {join} and {by_blob}.
std::string WithHints(const SqlDatabase& db, const std::string& sql) {
  return fmt::format(fmt::runtime(sql),
                     fmt::arg("join", db.dialect().ordered_join),
                     fmt::arg("by_blob", db.dialect().by_blob_index));
}

constexpr char kColorizerColumns[] =
    "select j.job_id, j.name, j.scene, a.sha256, a.size_bytes, j.end_ms ";

ColorizerRecord ColorizerFromRow(const SqlStatement& row) {
  return {row.Int(0), row.Text(1), row.Text(2), {row.Text(3), row.Int(4)}, row.Int(5)};
}

}  // namespace

// Equal files of several jobs (cached runs) are one colorizer: that of the oldest job.
std::vector<ColorizerRecord> SqlJobStore::ListColorizers(const std::optional<std::string>& project,
                                                         const std::string& scene,
                                                         int64_t before_id,
                                                         int limit) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<ColorizerRecord> {
    // Scans the smaller set: the jobs of the scene, or all colorizers, newest first.
    const std::string walk =
        scene.empty() ? "from artifact a {join} job j on j.job_id=a.job_id where "
                      : "from job j {join} artifact a on a.job_id=j.job_id where j.scene=?3 and ";
    const std::string sql =
        kColorizerColumns + walk + IsColorizer("a", "j") +
        " and j.job_id<?4 and not exists(select 1 from artifact older {by_blob} {join} job o on "
        "o.job_id=older.job_id where older.sha256=a.sha256 and older.job_id<a.job_id and " +
        IsColorizer("older", "o") + ") order by " + (scene.empty() ? "a" : "j") +
        ".job_id desc limit ?5";
    return SqlStatement(db,
                        WithHints(db, sql),
                        !project,
                        project.value_or(""),
                        scene,
                        before_id > 0 ? before_id : INT64_MAX,
                        limit)
        .All(ColorizerFromRow);
  });
}

ColorizerRecord SqlJobStore::GetColorizer(const std::optional<std::string>& project,
                                          const std::string& sha256) {
  return connections_->Read([&](SqlDatabase& db) -> ColorizerRecord {
    SqlStatement select(
        db,
        WithHints(db,
                  kColorizerColumns +
                      ("from artifact a {by_blob} {join} job j on j.job_id=a.job_id where "
                       "a.sha256=?4 and " +
                       IsColorizer("a", "j") + " order by a.job_id limit 1")),
        !project,
        project.value_or(""),
        "",
        sha256);
    if (!select.Step()) {
      throw ServiceError(
          ErrorReason::kColorizerNotFound, "there is no colorizer 'colorizers/{}'", sha256);
    }
    return ColorizerFromRow(select);
  });
}

}  // namespace color3d
