// Tables of the SQLite job store. Times are milliseconds since the epoch of the injected wall
// clock; lease_expires_ms and run_after_ms are of the steady clock.
#pragma once

namespace color3d {

constexpr int kSchemaVersion = 7;

// Since version 4. A project holds the blobs that it uploaded and the results of its jobs.
#define COLOR3D_PROJECT_TABLES                                                                  \
  "create table project(name text primary key, turn integer not null default 0, "               \
  "bytes integer not null default 0) without rowid;"                                            \
  "create table blob_holding(project text not null, sha256 text not null, "                     \
  "size_bytes integer not null, primary key(project, sha256)) without rowid;"                   \
  "create index blob_holding_digest on blob_holding(sha256);"                                   \
  "create trigger blob_held after insert on blob_holding begin "                                \
  "insert into project(name, bytes) values(new.project, new.size_bytes) "                       \
  "on conflict(name) do update set bytes=bytes+excluded.bytes; end;"                            \
  "create trigger blob_let_go after delete on blob_holding begin "                              \
  "update project set bytes=bytes-old.size_bytes where name=old.project; end;"                  \
  "create table notification(job_id integer primary key references job on delete cascade, "     \
  "url text not null, tries integer not null, first_ms integer not null, "                      \
  "next_ms integer not null);"                                                                  \
  "create table expiry_candidate(job_id integer primary key references job on delete cascade, " \
  "age_ms integer not null);"                                                                   \
  "insert into meta values('hold_paused', 0), ('hold_storage', 0), ('expiry_steady_ms', 0);"

// Since version 6: the size of rows counts towards the usage of a project (row_bytes), and its
// scenes are counted. A blob counts a disk block beyond its length, a request id its row.
#define COLOR3D_ACCOUNT(event, sum, name, amount)                                              \
  "create trigger " event " begin insert into project(name, " sum ") values(" name ", " amount \
  ") on conflict(name) do update set " sum "=" sum "+excluded." sum "; end;"
#define COLOR3D_REQUEST_PROJECT(id) \
  "case instr(" id ", '@') when 0 then '' else substr(" id ", instr(" id ", '@')+1) end"
#define COLOR3D_ACCOUNTS \
  "alter table project add column row_bytes integer not null default 0;"                      \
  "alter table project add column scenes integer not null default 0;"                         \
  "alter table project add column uncommitted integer not null default 0;"                    \
  COLOR3D_ACCOUNT("scene_rows after insert on scene", "row_bytes", "new.project",             \
                  "new.row_bytes")                                                            \
  COLOR3D_ACCOUNT("scene_counted after insert on scene", "scenes", "new.project", "1")        \
  COLOR3D_ACCOUNT("scene_begun after insert on scene when new.active=0", "uncommitted",       \
                  "new.project", "1")                                                         \
  COLOR3D_ACCOUNT("scene_committed after update of active on scene when old.active<>"         \
                  "new.active", "uncommitted", "new.project", "old.active-new.active")        \
  "create trigger scene_gone after delete on scene begin update project set "                 \
  "row_bytes=row_bytes-old.row_bytes, scenes=scenes-1, "                                      \
  "uncommitted=uncommitted-(old.active=0) where name=old.project; end;"                       \
  COLOR3D_ACCOUNT("job_rows after insert on job", "row_bytes", "new.project", "new.row_bytes") \
  COLOR3D_ACCOUNT("job_grown after update of row_bytes on job", "row_bytes", "new.project",   \
                  "new.row_bytes-old.row_bytes")                                              \
  COLOR3D_ACCOUNT("job_gone after delete on job", "row_bytes", "old.project",                 \
                  "-old.row_bytes")                                                           \
  COLOR3D_ACCOUNT("blob_rows after insert on blob_holding", "row_bytes", "new.project", "4096") \
  COLOR3D_ACCOUNT("blob_rows_gone after delete on blob_holding", "row_bytes", "old.project",  \
                  "-4096")                                                                    \
  COLOR3D_ACCOUNT("request_rows after insert on request_id", "row_bytes",                     \
                  COLOR3D_REQUEST_PROJECT("new.id"), "300")                                   \
  COLOR3D_ACCOUNT("request_rows_gone after delete on request_id", "row_bytes",                \
                  COLOR3D_REQUEST_PROJECT("old.id"), "-300")

// Since version 6 the path is not part of a key: an index stored it a second time, and a path of
// 970 bytes took two pages.
#define COLOR3D_SCENE_FILES                                                            \
  "create table scene_file(scene_file_id integer primary key, "                        \
  "scene_id integer not null references scene on delete cascade, path text not null, " \
  "sha256 text not null, size_bytes integer not null);"                                \
  "create index scene_file_scene on scene_file(scene_id);"                             \
  "create index scene_file_blob on scene_file(sha256);"

// Since version 7: needs, deadlines and preferred workers of jobs, weights of projects.
#define COLOR3D_PLACEMENT                                                                      \
  "alter table job add column deadline_ms integer not null default 9223372036854775807;"       \
  "alter table job add column needs_memory_bytes integer not null default 0;"                  \
  "alter table job add column needs_models text not null default '';"                          \
  "alter table job add column batch_group text not null default '';"                           \
  "alter table job add column preferred_worker text not null default '';"                      \
  "alter table job add column preferred_until_ms integer not null default 0;"                  \
  "create index job_next on job(project, priority, deadline_ms, job_id) where state='QUEUED';" \
  "create index job_models on job(needs_models) where state='QUEUED' and needs_models<>'';"    \
  "alter table project add column weight integer not null default 1;"                          \
  "drop table worker;"                                                                         \
  "create table worker(worker_id text primary key, pid integer not null, job text not null, "  \
  "memory_bytes integer not null, heartbeat_ms integer not null, "                             \
  "machine text not null default '', release text not null default '', "                       \
  "threads integer not null default 0, memory_limit_bytes integer not null default 0, "        \
  "simd text not null default '', cache_bytes integer not null default 0, "                    \
  "cache_limit_bytes integer not null default 0, cache_hit_bytes integer not null default 0, " \
  "cache_miss_bytes integer not null default 0, "                                              \
  "finished_jobs integer not null default 0) without rowid;"

// From version 1 to 2, from 2 to 3 and so on.
constexpr const char* kMigrations[kSchemaVersion - 1] = {
    "alter table scene add column key_color_job text not null default ''",
    "create index job_unfinished on job(job_id) where end_ms=0;"
    "create index job_checkpoint on job(checkpoint_sha256) where checkpoint_sha256 <> '';"
    "create index artifact_name on artifact(name, job_id);"
    "create table server(id integer primary key check(id=1), version text not null, "
    "boot_id text not null);"
    "create table blob_candidate(sha256 text primary key, touched_ns integer not null, "
    "age_ms integer not null) without rowid;"
    "insert into meta values('collected_steady_ms', 0);"
    "alter table job add column lost_input text not null default ''",
    "alter table scene add column project text not null default '';"
    "alter table job add column project text not null default '';"
    "alter table job add column pinned integer not null default 0;"
    "alter table job add column queued_ms integer not null default 0;"
    "alter table job add column queued_since_ms integer not null default 0;"
    "alter table job add column running_key text not null default '';"
    "alter table job add column joins_key text not null default '';"
    "alter table job add column notify_url text not null default '';"
    "alter table job add column trace text not null default '';"
    "create index scene_project on scene(project, scene_id);"
    "create index job_project on job(project, job_id);"
    "create index job_running_key on job(running_key) where running_key <> '';"
    "create index job_ended on job(end_ms) where parent='' and end_ms<>0 and "
    "pinned=0;" COLOR3D_PROJECT_TABLES
    "insert or ignore into blob_holding select '', sha256, size_bytes from artifact;"
    "insert or ignore into blob_holding select '', sha256, size_bytes from scene_file;"
    "insert or ignore into blob_holding select '', sha256, 0 from job_blob;",
    "create index request_id_age on request_id(at_ms);"
    "alter table scene add column unused_age_ms integer not null default -1;"
    "insert into meta values('requests_steady_ms', 0), ('requests_age_ms', 0), "
    "('requests_noted_ms', 0), ('scenes_steady_ms', 0)",
    "drop index scene_file_blob; alter table scene_file rename to scene_file_before;"  //
    COLOR3D_SCENE_FILES
    "insert into scene_file(scene_id, path, sha256, size_bytes) "
    "select scene_id, path, sha256, size_bytes from scene_file_before;"
    "drop table scene_file_before;"
    "alter table scene add column row_bytes integer not null default 0;"
    "alter table job add column row_bytes integer not null default 0;"
    "update scene set row_bytes=512+length(display_name)+(select coalesce(sum(200+length(path)), "
    "0) from scene_file f where f.scene_id=scene.scene_id);"
    "update job set row_bytes=2048+length(spec)+length(notify_url)+length(skip_reason)+"
    "300*(select count(*) from artifact a where a.job_id=job.job_id)+"
    "200*(select count(*) from job_blob b where b.job_id=job.job_id)+"
    "40*(select count(*) from job_dependency d where d.job_id=job.job_id);"  //
    COLOR3D_ACCOUNTS
    "insert or ignore into project(name) select distinct project from scene;"
    "insert or ignore into project(name) select distinct project from job;"
    "update project set "
    "scenes=(select count(*) from scene where scene.project=project.name), "
    "uncommitted=(select count(*) from scene where scene.project=project.name and active=0), "
    "row_bytes=(select coalesce(sum(row_bytes), 0) from scene where "
    "scene.project=project.name)+(select coalesce(sum(row_bytes), 0) from job where "
    "job.project=project.name)+4096*(select count(*) from blob_holding h where "
    "h.project=project.name)+300*(select count(*) from request_id r where "  //
    COLOR3D_REQUEST_PROJECT("r.id") "=project.name)",
    COLOR3D_PLACEMENT};

constexpr char kSchema[] = R"sql(
create table scene(
  scene_id integer primary key autoincrement,
  name text not null unique, display_name text not null,
  active integer not null default 0, layout integer not null default 0,
  photo_count integer not null default 0,
  create_ms integer not null, commit_ms integer not null default 0,
  key_color_job text not null default '', project text not null default '',
  unused_age_ms integer not null default -1, row_bytes integer not null default 0);
create index scene_project on scene(project, scene_id);

create table job(
  job_id integer primary key autoincrement,
  name text not null unique, parent text not null default '',
  kind text not null, scene text not null, spec blob not null,
  state text not null check(state in(
    'BLOCKED','QUEUED','RUNNING','SUCCEEDED','FAILED','CANCELLED','SKIPPED')),
  cancel_requested integer not null default 0,
  priority integer not null default 100, run_after_ms integer not null default 0,
  attempt integer not null default 0, max_attempts integer not null default 3,
  lost_attempts integer not null default 0,
  lease_epoch integer not null default 0, lease_owner text not null default '',
  lease_expires_ms integer,
  progress_step integer not null default 0, progress_total integer not null default 0,
  progress_message text not null default '', progress_error_name text not null default '',
  progress_error_value real not null default 0, seconds real not null default 0,
  eta_seconds real not null default -1,
  error_code integer, error_reason text not null default '',
  error_message text not null default '',
  skip_reason text not null default '', skipped_by_plan integer not null default 0,
  cached integer not null default 0, warnings text not null default '',
  checkpoint_sha256 text not null default '', checkpoint_bytes integer not null default 0,
  stage_key text not null default '',
  create_ms integer not null, start_ms integer not null default 0,
  end_ms integer not null default 0,
  revision integer not null default 0, peak_memory_bytes integer not null default 0,
  lost_input text not null default '', project text not null default '',
  pinned integer not null default 0, queued_ms integer not null default 0,
  queued_since_ms integer not null default 0, running_key text not null default '',
  joins_key text not null default '', notify_url text not null default '',
  trace text not null default '', row_bytes integer not null default 0,
  check((state='RUNNING') = (lease_expires_ms is not null)),
  check((state in('SUCCEEDED','FAILED','CANCELLED','SKIPPED')) = (end_ms <> 0)));
create index job_claim on job(priority, job_id) where state='QUEUED';
create index job_lease on job(lease_expires_ms) where state='RUNNING';
create index job_parent on job(parent, job_id);
create index job_scene on job(scene, job_id);
create index job_stage on job(stage_key) where stage_key <> '';
create index job_unfinished on job(job_id) where end_ms=0;
create index job_checkpoint on job(checkpoint_sha256) where checkpoint_sha256 <> '';
create index job_project on job(project, job_id);
create index job_running_key on job(running_key) where running_key <> '';
create index job_ended on job(end_ms) where parent='' and end_ms<>0 and pinned=0;

create table job_dependency(
  input_id integer not null references job on delete cascade,
  job_id integer not null references job on delete cascade,
  primary key(job_id, input_id)) without rowid;
create index job_dependant on job_dependency(input_id);
create table job_blob(
  job_id integer not null references job on delete cascade, sha256 text not null,
  primary key(job_id, sha256)) without rowid;
create index job_blob_digest on job_blob(sha256);
create table artifact(
  job_id integer not null references job on delete cascade,
  name text not null, sha256 text not null, size_bytes integer not null,
  media_type text not null,
  primary key(job_id, name)) without rowid;
create index artifact_blob on artifact(sha256);
create index artifact_name on artifact(name, job_id);
create table job_attempt(
  job_id integer not null references job on delete cascade, epoch integer not null,
  worker text not null, start_ms integer not null, end_ms integer not null default 0,
  outcome text not null default '',
  primary key(job_id, epoch)) without rowid;
create table job_event(
  revision integer primary key autoincrement,
  job_id integer not null references job on delete cascade,
  progress integer not null, state text not null, attempt integer not null,
  at_ms integer not null);
create index job_event_job on job_event(job_id, revision);

create table blob_candidate(
  sha256 text primary key, touched_ns integer not null, age_ms integer not null) without rowid;
create table request_id(
  method text not null, id text not null, body_sha256 text not null,
  resource text not null, at_ms integer not null,
  primary key(method, id)) without rowid;
create index request_id_age on request_id(at_ms);
create table worker(
  worker_id text primary key, pid integer not null, job text not null,
  memory_bytes integer not null, heartbeat_ms integer not null) without rowid;
create table server(id integer primary key check(id=1), version text not null, boot_id text not null);
create table meta(name text primary key, value integer not null) without rowid;
insert into meta values('compacted_revision', 0), ('collected_steady_ms', 0),
  ('requests_steady_ms', 0), ('requests_age_ms', 0), ('requests_noted_ms', 0),
  ('scenes_steady_ms', 0);
)sql" COLOR3D_SCENE_FILES COLOR3D_PROJECT_TABLES COLOR3D_ACCOUNTS COLOR3D_PLACEMENT;

}  // namespace color3d
