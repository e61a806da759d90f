"""The client: uploads, jobs, progress and results."""

from __future__ import annotations

import datetime
import hashlib
import json
import os
import tempfile
import time
import uuid
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Union

import grpc

from color3d import photos as photo_files
from color3d.connection import DEFAULT_SERVER, Backoff, Connection, PathLike, Tls
from color3d.errors import InputError, JobFailedError, RpcError, lost
from color3d.options import read_preset, set_options
from color3d.transfer import Transfer, TransferProgress, digest_file, safe_path_below
from color3d.v1 import admin_pb2_grpc, blob_pb2, blob_pb2_grpc, colorizer_pb2_grpc
from color3d.v1 import job_pb2, job_pb2_grpc, key_view_pb2, scene_pb2, scene_pb2_grpc
from color3d.v1 import server_pb2, server_pb2_grpc, stage_pb2

# A coloured picture of a view; points as a .json file; "auto" for an automatic guess; or any source
# of the API, whose files are uploaded with Client.upload_files.
KeyColor = Union[PathLike, key_view_pb2.KeyColorSource]
OnEvent = Callable[[job_pb2.JobEvent], None]

_WATCH_PATIENCE_S = 60.0
_COMMIT_LIMIT_S = 600.0  # the server reads every file once
# The current state of all jobs comes first; a stream that broke earlier may have sent part of it.
_SNAPSHOT_S = 2.0
_FINISHED = frozenset(
    getattr(job_pb2.Job, "STATE_" + name)
    for name in ("SUCCEEDED", "FAILED", "CANCELLED", "SKIPPED")
)
# Codes of errors that a repetition does not mend.
_WRONG_INPUT = frozenset(
    code.value[0]
    for code in (
        grpc.StatusCode.INVALID_ARGUMENT,
        grpc.StatusCode.FAILED_PRECONDITION,
        grpc.StatusCode.NOT_FOUND,
    )
)


class Client:
    """A connection to a Color3D server. One thread at a time.

    address: HOST:PORT, unix:PATH, or https://HOST:PORT for TLS; default: COLOR3D_SERVER of the
        environment, else 127.0.0.1:50551.
    token: from the operator; default: COLOR3D_TOKEN of the environment. Is never sent unencrypted
        to another machine.
    tls: certificates, unless those of the system suffice.
    patience_s: maximum time to wait for a server that does not answer, seconds.

    Raises UnreachableError if no server answers within 4 s, InputError for a malformed address.
    All calls raise RpcError, with the server's reason and remedy, if the server refuses them, and
    UnreachableError if it is lost. Calls are repeated while that can help, and do nothing twice.
    The stubs scenes, jobs, blobs, colorizers, server and admin give access to the whole API:
    client.call(client.jobs.GetJob, request).
    """

    def __init__(
        self,
        address: Optional[str] = None,
        *,
        token: Optional[str] = None,
        tls: Optional[Tls] = None,
        patience_s: float = 30.0,
    ) -> None:
        address = address or os.environ.get("COLOR3D_SERVER") or DEFAULT_SERVER
        token = (token if token is not None else os.environ.get("COLOR3D_TOKEN", "")).strip()
        self._connection = Connection(address, token, tls, patience_s)
        self._transfer = Transfer(self._connection)
        channel = self._connection.channel
        self.call = self._connection.call
        self.scenes = scene_pb2_grpc.SceneServiceStub(channel)
        self.jobs = job_pb2_grpc.JobServiceStub(channel)
        self.blobs = blob_pb2_grpc.BlobServiceStub(channel)
        self.colorizers = colorizer_pb2_grpc.ColorizerServiceStub(channel)
        self.server = server_pb2_grpc.ServerServiceStub(channel)
        self.admin = admin_pb2_grpc.AdminServiceStub(channel)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection. Jobs go on."""
        self._connection.channel.close()

    def server_info(self) -> server_pb2.ServerInfo:
        """Returns version, limits, models and presets of the server, and the caller's project."""
        return self.call(self.server.GetServerInfo, server_pb2.GetServerInfoRequest())

    # Uploads.

    def upload_files(
        self, files: Iterable[PathLike], progress: Optional[TransferProgress] = None
    ) -> List[blob_pb2.Digest]:
        """Sends the files that the server lacks, and returns the digest of each.

        progress: called with bytes sent and all bytes to send.
        """
        paths = [Path(file) for file in files]
        digests = {path: digest_file(path) for path in paths}
        self._transfer.upload_missing(digests, progress)
        return [digests[path] for path in paths]

    def upload(
        self,
        photos: Union[PathLike, Mapping[str, PathLike]],
        *,
        display_name: str = "",
        progress: Optional[TransferProgress] = None,
    ) -> scene_pb2.Scene:
        """Uploads photos as a scene. The same files give the same scene, and are sent once.

        photos: a folder (photos.collect says what is taken), a splat, a film, or {path in the
            scene: file} for anything else, e.g. masks/a.png; paths: SceneFile in scene.proto.
        Raises InputError for missing or too few files; RpcError (SCENE_INVALID) that names each
        file that the server cannot read.
        """
        if isinstance(photos, Mapping):
            files = {path: Path(file) for path, file in photos.items()}
        else:
            files = photo_files.collect(Path(photos))
            display_name = display_name or Path(photos).resolve().name
        digests = {path: digest_file(file) for path, file in files.items()}
        sha = hashlib.sha256("".join(f"{p}\n{d.sha256}\n" for p, d in digests.items()).encode())
        scene_id = "photos-" + sha.hexdigest()[:32]
        scene = self._find_scene("scenes/" + scene_id)
        if scene and scene.state == scene_pb2.Scene.STATE_ACTIVE:
            return scene
        if not scene:
            create = scene_pb2.CreateSceneRequest(
                files=[scene_pb2.SceneFile(path=p, digest=d) for p, d in digests.items()],
                scene_id=scene_id,
                display_name=display_name.encode()[:200].decode(errors="ignore"),
                request_id=str(uuid.uuid4()),
            )
            try:
                scene = self.call(self.scenes.CreateScene, create)
            except RpcError as e:  # another client created the same scene
                if e.code != grpc.StatusCode.ALREADY_EXISTS:
                    raise
        self._transfer.upload_missing({files[p]: d for p, d in digests.items()}, progress)
        commit = scene_pb2.CommitSceneRequest(
            name="scenes/" + scene_id, request_id=str(uuid.uuid4())
        )
        return self.call(self.scenes.CommitScene, commit, _COMMIT_LIMIT_S)

    def _find_scene(self, name: str) -> Optional[scene_pb2.Scene]:
        try:
            return self.call(self.scenes.GetScene, scene_pb2.GetSceneRequest(name=name))
        except RpcError as e:
            if e.code == grpc.StatusCode.NOT_FOUND:
                return None
            raise

    def key_color(self, source: KeyColor) -> key_view_pb2.KeyColorSource:
        """Uploads the file of a source of colour, and returns the source."""
        if isinstance(source, key_view_pb2.KeyColorSource):
            return source
        if source == "auto":
            return key_view_pb2.KeyColorSource(automatic=True)
        [digest] = self.upload_files([source])
        if Path(source).suffix == ".json":
            return key_view_pb2.KeyColorSource(points=digest)
        return key_view_pb2.KeyColorSource(image=digest)

    # Jobs.

    def colorize_spec(
        self,
        scene: str,
        *,
        key_color: KeyColor,
        key_view: str = "",
        add_key_views: Optional[Mapping[str, KeyColor]] = None,
        preset: str = "fast",
        options: Optional[Mapping[str, Any]] = None,
        truth: Optional[Mapping[str, PathLike]] = None,
        seed: int = 0,
    ) -> job_pb2.JobSpec:
        """Uploads the pictures and returns the job that colours a scene, not yet submitted.

        scene: name of a scene, "scenes/ID".
        key_color: colours of the key view, a picture of its size; transparent parts are inferred.
        key_view: name of its photo; default: the photo with the name of the coloured picture, else
            the server selects it.
        add_key_views: {photo: colours} of further key views, the most important first.
        preset: "fast", "best", "paper", or a file that `color3d server presets NAME` prints.
        options: {"stage.field": value}, e.g. {"max_side_px": 400, "carry_color.depth_tolerance":
            0.05}; override the preset. proto/README.md lists ranges and units.
        truth: {photo: its true colours} of views that are held out for evaluation
            ("import_scene.hold_out_every_eighth": True): the result is scored against them, as a
            benchmark of `color3d colorize` is.
        seed: the same seed gives the same result on the same machine; 0: the server's default.
        Raises InputError for unknown photos, presets and options and for values out of range.
        """
        spec = job_pb2.JobSpec(scene=scene, seed=seed, colorize_scene=read_preset(preset))
        colorize = spec.colorize_scene
        set_options(colorize, options or {})
        stored = self.call(self.scenes.GetScene, scene_pb2.GetSceneRequest(name=scene))
        stems: Dict[str, List[str]] = {}
        for name in photo_files.photo_names(file.path for file in stored.files):
            stems.setdefault(Path(name).stem, []).append(name)
        for view in [key_view, *(add_key_views or {}), *(truth or {})]:
            if view and stems and Path(view).stem not in stems:
                some = ", ".join(name for names in list(stems.values())[:3] for name in names)
                raise InputError(f"no photo of {scene} is called '{view}'; there are {some}, ...")
        if not key_view and isinstance(key_color, (str, Path)):
            same = stems.get(Path(key_color).stem, [])
            key_view = same[0] if len(same) == 1 else ""
        colorize.key_view = key_view
        colorize.key_color.CopyFrom(self.key_color(key_color))
        for view, source in (add_key_views or {}).items():
            added = stage_pb2.FurtherKeyView(view=view, color=self.key_color(source))
            colorize.carry_color.further_key_views.append(added)
        images = self.upload_files((truth or {}).values())
        for view, image in zip(truth or {}, images):
            colorize.truth.append(stage_pb2.TruthImage(view=view, image=image))
        return spec

    def colorize(
        self,
        photos: Union[PathLike, Mapping[str, PathLike]],
        out: PathLike,
        *,
        on_event: Optional[OnEvent] = None,
        **choices: Any,
    ) -> job_pb2.Job:
        """Colours photos and writes the results to the folder `out`, as `color3d colorize`.

        photos: as in upload, or the name of a stored scene, "scenes/ID".
        on_event: called for each change of state and progress; see watch.
        choices: arguments of colorize_spec; key_color is required.
        Returns the finished job. Raises JobFailedError; the errors of upload, colorize_spec and
        download. If it is interrupted the job goes on: client.wait([NAME]), client.download(...).
        """
        out = Path(out)
        if isinstance(photos, str) and photos.startswith("scenes/"):
            scene = photos
        else:
            if not isinstance(photos, Mapping) and Path(photos).resolve() in (
                out.resolve(),
                out.resolve().parent if out.name == "images" else None,
            ):
                raise InputError(f"{out} has the photos; name another folder for the results")
            scene = self.upload(photos).name
        job = self.submit(self.colorize_spec(scene, **choices))
        [job] = self.wait([job.name], on_event)
        self.download(job, out)
        return job

    def select_key_views(
        self, scene: str, count: int = 1, *, options: Optional[Mapping[str, Any]] = None
    ) -> job_pb2.Job:
        """Submits the choice of the photos to colour, made together for the least expected error.

        count: number of photos, 1 to 17. options: as in colorize_spec, of import_scene and
            select_key_view.
        Once the job has succeeded, chosen_views returns the names, and download writes the first of
        them as key_view.png, to be coloured.
        """
        chosen = read_preset("fast")
        set_options(chosen, {**(options or {}), "select_key_view.count": count})
        spec = job_pb2.JobSpec(scene=scene, select_key_view=chosen.select_key_view)
        if chosen.HasField("import_scene"):
            import_spec = job_pb2.JobSpec(scene=scene, import_scene=chosen.import_scene)
            spec.inputs.append(self.submit(import_spec).name)
        return self.submit(spec)

    def chosen_views(self, job: job_pb2.Job) -> List[str]:
        """Returns the views that a finished job of select_key_views chose, the best first."""
        chosen = json.loads(self.read_artifact(job, "key_view.json"))
        return [view["view"] for view in chosen.get("key_views", [chosen])]

    def submit(
        self,
        spec: job_pb2.JobSpec,
        *,
        notify_url: str = "",
        priority: int = 100,
        deadline: Optional[datetime.datetime] = None,
    ) -> job_pb2.Job:
        """Creates a job, once, however often the call is repeated underneath.

        notify_url: address that receives a notification at the end, if the operator allows it.
        priority: 0 to 1000; lower values start first.
        deadline: time by which the result is needed, with its time zone. Of the waiting jobs of a
            project with equal priority, the earliest deadline starts first.
        """
        request = job_pb2.CreateJobRequest(
            spec=spec, request_id=str(uuid.uuid4()), notify_url=notify_url, priority=priority
        )
        if deadline is not None:
            if deadline.tzinfo is None:
                raise ValueError("deadline has no time zone; use datetime.now(timezone.utc) + ...")
            request.deadline.FromSeconds(int(deadline.timestamp()))
        return self.call(self.jobs.CreateJob, request)

    def job(self, name: str) -> job_pb2.Job:
        """Returns the present state of a job, "jobs/ID", with its progress and artifacts."""
        return self.call(self.jobs.GetJob, job_pb2.GetJobRequest(name=name))

    def children(self, name: str) -> List[job_pb2.Job]:
        """Returns the stages of a job, oldest first."""
        found: List[job_pb2.Job] = []
        request = job_pb2.ListJobsRequest(parent=name, page_size=1000)
        while True:
            page = self.call(self.jobs.ListJobs, request)
            found += page.jobs
            if not page.next_page_token:
                return found[::-1]
            request.page_token = page.next_page_token

    def cancel(self, name: str) -> job_pb2.Job:
        """Cancels a job and its stages. Running ones end at their next step."""
        request = job_pb2.CancelJobRequest(name=name, request_id=str(uuid.uuid4()))
        return self.call(self.jobs.CancelJob, request)

    def retry(self, name: str) -> job_pb2.Job:
        """Restarts a failed or cancelled job from its last checkpoint."""
        request = job_pb2.RetryJobRequest(name=name, request_id=str(uuid.uuid4()))
        return self.call(self.jobs.RetryJob, request)

    def watch(self, names: Sequence[str]) -> Iterator[job_pb2.JobEvent]:
        """Yields each change of state and the progress of 1 to 100 jobs and their stages, in order.

        Ends when all have ended. After a broken stream it resumes at the last revision seen; raises
        UnreachableError if the server does not come back within 60 s.
        """
        backoff, revision = Backoff(_WATCH_PATIENCE_S), 0
        while True:
            begun, newest = time.monotonic(), revision
            request = job_pb2.WatchJobsRequest(names=names, after_revision=revision)
            try:
                for event in self._connection.stream(self.jobs.WatchJobs, request):
                    backoff.reset()
                    newest = max(newest, event.revision)
                    if event.HasField("job"):
                        yield event
                return
            except RpcError as e:
                error = e
            if revision or time.monotonic() - begun > _SNAPSHOT_S:
                revision = newest
            if error.code == grpc.StatusCode.OUT_OF_RANGE and revision:
                revision = 0  # events in between are lost: ask for the current state
            elif not backoff.wait(error):
                if error.is_transient():
                    raise lost(self._connection.address, error)
                raise error

    def wait(self, names: Sequence[str], on_event: Optional[OnEvent] = None) -> List[job_pb2.Job]:
        """Waits until jobs have ended, and returns their final states.

        Raises JobFailedError with the failed stage and its reason if one has not succeeded; others
        are then not affected.
        """
        unfinished = set(names)
        for event in self.watch(names):
            if on_event:
                on_event(event)
            if event.job.state in _FINISHED:
                unfinished.discard(event.job.name)
            if not unfinished:  # stages of a failed job may go on
                break
        jobs = [self.job(name) for name in names]
        for job in jobs:
            self._require_success(job)
        return jobs

    def _require_success(self, job: job_pb2.Job) -> None:
        if job.state == job_pb2.Job.STATE_SUCCEEDED:
            return
        again = f"client.retry('{job.name}') continues it"
        if job.state == job_pb2.Job.STATE_CANCELLED:
            raise JobFailedError(f"{job.name} was cancelled; {again}", job, job)
        failed = [j for j in self.children(job.name) if j.state == job_pb2.Job.STATE_FAILED]
        blamed = failed[0] if failed else job
        state = job_pb2.Job.State.Name(blamed.state)
        reason = blamed.error.message or blamed.skip_reason or f"it is {state}"
        message = f"the stage {blamed.kind} failed ({blamed.name}): {reason}"
        if blamed.error.code not in _WRONG_INPUT:
            message += f"; {again} from its last checkpoint"
        raise JobFailedError(message, job, blamed)

    # Results.

    def download(
        self,
        job: Union[str, job_pb2.Job],
        out: PathLike,
        names: Optional[Iterable[str]] = None,
        progress: Optional[TransferProgress] = None,
    ) -> List[Path]:
        """Writes results of a job to out/NAME and returns the files.

        names: default: all. progress: called with bytes received and all bytes.
        Each file is verified and then renamed into place; complete files are kept, and partial ones
        resumed by a later call. Raises InputError for unknown names, DamagedDataError.
        """
        job = self.job(job) if isinstance(job, str) else job
        known = {artifact.name: artifact.digest for artifact in job.artifacts}
        wanted = list(known if names is None else names)
        for name in wanted:
            if name not in known:
                some = ", ".join(list(known)[:8]) or "none: it has not succeeded"
                raise InputError(f"{job.name} has no result '{name}'; it has {some}")
        total, done, files = sum(known[name].size_bytes for name in wanted), 0, []
        report = progress or (lambda done, total: None)
        for name in wanted:
            files.append(safe_path_below(Path(out), name))
            self._transfer.download(known[name], files[-1], lambda got: report(done + got, total))
            done += known[name].size_bytes
            report(done, total)
        return files

    def download_blob(self, digest: blob_pb2.Digest, path: PathLike) -> None:
        """Writes one blob to a file, as download."""
        self._transfer.download(digest, path)

    def read_artifact(self, job: Union[str, job_pb2.Job], name: str) -> bytes:
        """Returns the bytes of one result, e.g. "metrics.json". Raises as download."""
        with tempfile.TemporaryDirectory(prefix="color3d-") as folder:
            return self.download(job, folder, [name])[0].read_bytes()
