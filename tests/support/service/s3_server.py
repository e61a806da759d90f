#!/usr/bin/env python3
"""An object store in memory that answers as Amazon's and MinIO's references document, for tests.

It verifies Signature Version 4 by itself, and fails on demand. Usage: s3_server.py PORT_FILE [KEY=VALUE...]
A test sends JSON to /_control to change the settings below, and reads /_control/log, one line a request.

A fault is {"match": REGEX of "VERB KEY?QUERY", "count": N, "kind": ...} and holds for the next N requests that
match: status (with "status", "code", "message", "headers"), drop (closes the connection), lose (does the request, then
closes the connection), truncate (sends half of the body), stall (sends half of the body, then waits "seconds"), slow
(sends the body over "seconds"), late (waits "seconds" before the request), other_bytes (changes a byte of the body).
"""
import datetime
import email.utils
import hashlib
import hmac
import http.server
import json
import os
import re
import sys
import threading
import time
import urllib.parse
import xml.etree.ElementTree
from xml.sax.saxutils import escape

SETTINGS = {
    "host": "127.0.0.1",  # address to listen at; only at the start
    "bucket": "blobs",
    "id": "TESTKEY",
    "secret": "test/secret+of=the/store",
    "token": "",
    "region": "us-east-1",
    "page": 1000,
    "skew_seconds": 0,  # added to the clock of the store
    "denied": "",       # REGEX of "VERB KEY?QUERY" that is answered with AccessDenied
    "conditions": True,  # knows If-None-Match and If-Match of writes
    "stale": False,     # lists nothing, as a store that is not consistent
    "faults": [],
}
LOCK = threading.RLock()
OBJECTS = {}  # key: (bytes, etag, time)
UPLOADS = {}  # id: [key, {number: (bytes, etag)}, time]
LOG = []
EMPTY_SHA256 = hashlib.sha256(b"").hexdigest()


class Refusal(Exception):
    def __init__(self, status, code, message="", extra=""):
        super().__init__(code)
        self.status, self.code, self.message, self.extra = status, code, message, extra


class Dropped(Exception):
    pass


def now():
    return time.time() + float(SETTINGS["skew_seconds"])


def iso(seconds):
    return datetime.datetime.utcfromtimestamp(seconds).strftime("%Y-%m-%dT%H:%M:%S.000Z")


def hmac_sha256(key, text):
    return hmac.new(key, text.encode(), hashlib.sha256).digest()


def signature(secret, method, raw_path, query, headers, names, payload, stamp, region):
    """Signature Version 4 from what was received."""
    encode = lambda text, safe: urllib.parse.quote(text, safe=safe + "-_.~")
    canonical = "\n".join(
        [method, encode(urllib.parse.unquote(raw_path), "/"),
         "&".join(sorted("%s=%s" % (encode(n, ""), encode(v, "")) for n, v in query)),
         "".join("%s:%s\n" % (name, " ".join(headers.get(name, "").split())) for name in names), ";".join(names), payload])
    scope = "/".join([stamp[:8], region, "s3", "aws4_request"])
    text = "\n".join(["AWS4-HMAC-SHA256", stamp, scope, hashlib.sha256(canonical.encode()).hexdigest()])
    key = ("AWS4" + secret).encode()
    for part in (stamp[:8], region, "s3", "aws4_request"):
        key = hmac_sha256(key, part)
    return hmac.new(key, text.encode(), hashlib.sha256).hexdigest()


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    timeout = 120
    wbufsize = -1
    disable_nagle_algorithm = True

    def handle_expect_100(self):
        super().handle_expect_100()
        self.wfile.flush()
        return True

    def log_message(self, *_):
        pass

    # ---- the requests

    def handle_all(self):
        self.fault = None
        raw_path, _, raw_query = self.path.partition("?")
        if raw_path.startswith("/_control"):
            return self.control(raw_path)
        self.query = urllib.parse.parse_qsl(raw_query, keep_blank_values=True)
        names = dict(self.query)
        parts = urllib.parse.unquote(raw_path).lstrip("/").split("/", 1)
        key = parts[1] if len(parts) > 1 else ""
        line = "%s %s%s" % (self.command, key, "?" + raw_query if raw_query else "")
        try:
            with LOCK:
                LOG.append(line)
                self.fault = self.take_fault(line)
            if self.fault and self.fault["kind"] == "late":
                time.sleep(float(self.fault["seconds"]))
            body = self.read_body()
            if self.fault and self.fault["kind"] == "drop":
                raise Dropped()
            if self.fault and self.fault["kind"] == "status":
                raise Refusal(int(self.fault["status"]), self.fault.get("code", ""), self.fault.get("message", ""))
            self.authenticate(raw_path, body)
            if SETTINGS["denied"] and re.search(SETTINGS["denied"], line):
                raise Refusal(403, "AccessDenied", "Access Denied")
            if parts[0] != SETTINGS["bucket"]:
                raise Refusal(404, "NoSuchBucket", "The specified bucket does not exist")
            with LOCK:
                status, headers, answer = self.dispatch(key, names, body)
            if self.fault and self.fault["kind"] == "lose":
                raise Dropped()
            self.answer(status, headers, answer)
        except Refusal as refusal:
            text = ""
            if refusal.code:
                text = ('<?xml version="1.0" encoding="UTF-8"?>\n<Error><Code>%s</Code><Message>%s</Message>%s'
                        "<Resource>%s</Resource><RequestId>4442587FB7D0A2F9</RequestId></Error>" %
                        (refusal.code, escape(refusal.message), refusal.extra, escape(raw_path)))
            headers = dict(self.fault.get("headers", {})) if self.fault else {}
            self.answer(refusal.status, {"Content-Type": "application/xml", **headers}, text.encode())
        except (Dropped, ConnectionError):
            self.close_connection = True
            try:
                self.connection.shutdown(2)
            except OSError:
                pass

    do_GET = do_PUT = do_POST = do_DELETE = do_HEAD = handle_all

    @staticmethod
    def take_fault(line):
        for fault in SETTINGS["faults"]:
            if fault["count"] > 0 and re.search(fault["match"], line):
                fault["count"] -= 1
                return fault
        return None

    def read_body(self):
        size = int(self.headers.get("Content-Length") or 0)
        body = self.rfile.read(size)
        if len(body) != size:
            raise Dropped()
        return body

    def authenticate(self, raw_path, body):
        header = self.headers.get("Authorization", "")
        match = re.fullmatch(r"AWS4-HMAC-SHA256 Credential=([^/]+)/(\d{8})/([^/]+)/s3/aws4_request, ?"
                             r"SignedHeaders=([^,]+), ?Signature=([0-9a-f]{64})", header)
        if not match:
            raise Refusal(403, "AccessDenied", "Access Denied")
        key_id, day, region, names, given = match.groups()
        names = names.split(";")
        stamp = self.headers.get("x-amz-date", "")
        if key_id != SETTINGS["id"]:
            raise Refusal(403, "InvalidAccessKeyId", "The AWS Access Key Id you provided does not exist in our records.")
        if region != SETTINGS["region"]:
            raise Refusal(400, "AuthorizationHeaderMalformed",
                          "The authorization header is malformed; the region '%s' is wrong; expecting '%s'" %
                          (region, SETTINGS["region"]), "<Region>%s</Region>" % SETTINGS["region"])
        sent = datetime.datetime.strptime(stamp, "%Y%m%dT%H%M%SZ").replace(tzinfo=datetime.timezone.utc).timestamp()
        if abs(sent - now()) > 900:
            raise Refusal(403, "RequestTimeTooSkewed",
                          "The difference between the request time and the current time is too large.")
        must = {"host"} | {n.lower() for n in self.headers if n.lower().startswith("x-amz-")}
        must |= {n for n in ("range", "if-match", "if-none-match") if n in self.headers} & set(names)
        if not must <= set(names) or names != sorted(names) or stamp[:8] != day:
            raise Refusal(403, "AccessDenied", "There were headers present in the request which were not signed")
        if self.headers.get("x-amz-security-token", "") != SETTINGS["token"]:
            raise Refusal(400 if SETTINGS["token"] else 403, "InvalidToken", "The provided token is malformed.")
        headers = {name.lower(): value for name, value in self.headers.items()}
        payload = headers.get("x-amz-content-sha256", "")
        ours = signature(SETTINGS["secret"], self.command, raw_path, self.query, headers, names, payload, stamp, region)
        if not hmac.compare_digest(ours, given):
            raise Refusal(403, "SignatureDoesNotMatch",
                          "The request signature we calculated does not match the signature you provided.")
        if payload != hashlib.sha256(body).hexdigest():
            raise Refusal(400, "XAmzContentSHA256Mismatch",
                          "The provided 'x-amz-content-sha256' header does not match what was computed.")

    def dispatch(self, key, names, body):
        if not key:
            if self.command != "GET":
                raise Refusal(405, "MethodNotAllowed")
            return self.list_uploads(names) if "uploads" in names else self.list_objects(names)
        if "uploads" in names and self.command == "POST":
            upload = hashlib.md5(os.urandom(16)).hexdigest()
            UPLOADS[upload] = [key, {}, now()]
            return 200, {}, self.xml("InitiateMultipartUploadResult", "<Bucket>%s</Bucket><Key>%s</Key><UploadId>%s</UploadId>" %
                                     (SETTINGS["bucket"], escape(key), upload))
        if "uploadId" in names:
            return self.upload(key, names, body)
        if self.command == "PUT":
            self.require_condition(key)
            return self.store(key, body, '"%s"' % hashlib.md5(body).hexdigest())
        if self.command == "DELETE":
            self.require_condition(key)
            OBJECTS.pop(key, None)
            return 204, {}, b""
        if key not in OBJECTS:
            raise Refusal(404, "NoSuchKey", "The specified key does not exist.")
        body, etag, written = OBJECTS[key]
        headers = {"ETag": etag, "Last-Modified": email.utils.formatdate(written, usegmt=True), "Accept-Ranges": "bytes"}
        wanted = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        if not wanted or self.command == "HEAD":
            return 200, headers, body
        begin, end = int(wanted[1]), min(int(wanted[2] or len(body)), len(body) - 1)
        if begin >= len(body):
            raise Refusal(416, "InvalidRange", "The requested range is not satisfiable")
        headers["Content-Range"] = "bytes %d-%d/%d" % (begin, end, len(body))
        return 206, headers, body[begin:end + 1]

    def require_condition(self, key):
        if not SETTINGS["conditions"]:
            return
        fails = self.headers.get("If-None-Match") == "*" and key in OBJECTS
        wanted = self.headers.get("If-Match")
        if wanted and key not in OBJECTS and self.command == "DELETE":
            return
        if fails or (wanted and (key not in OBJECTS or OBJECTS[key][1] != wanted)):
            raise Refusal(412, "PreconditionFailed", "At least one of the pre-conditions you specified did not hold")

    @staticmethod
    def store(key, body, etag):
        OBJECTS[key] = (body, etag, now())
        return 200, {"ETag": etag}, b""

    def upload(self, key, names, body):
        upload = UPLOADS.get(names["uploadId"])
        if upload is None or upload[0] != key:
            raise Refusal(404, "NoSuchUpload", "The specified upload does not exist.")
        if self.command == "DELETE":
            del UPLOADS[names["uploadId"]]
            return 204, {}, b""
        if self.command == "PUT":
            etag = '"%s"' % hashlib.md5(body).hexdigest()
            upload[1][int(names["partNumber"])] = (body, etag)
            return 200, {"ETag": etag}, b""
        if self.fault and self.fault["kind"] == "fail_within":
            return 200, {}, (b'<?xml version="1.0" encoding="UTF-8"?>\n<Error><Code>InternalError</Code>'
                             b"<Message>We encountered an internal error. Please try again.</Message></Error>")
        self.require_condition(key)
        strip = lambda tag: tag.rsplit("}", 1)[-1]
        listed = [{strip(field.tag): field.text for field in part}
                  for part in xml.etree.ElementTree.fromstring(body) if strip(part.tag) == "Part"]
        parts = []
        for number, part in enumerate(listed, 1):
            known = upload[1].get(number)
            if int(part["PartNumber"]) != number or known is None or known[1] != part["ETag"]:
                raise Refusal(400, "InvalidPart", "One or more of the specified parts could not be found.")
            parts.append(known[0])
        if not parts:
            raise Refusal(400, "MalformedXML", "The XML you provided was not well-formed")
        del UPLOADS[names["uploadId"]]
        digest = hashlib.md5(b"".join(hashlib.md5(part).digest() for part in parts)).hexdigest()
        etag = '"%s-%d"' % (digest, len(parts))
        self.store(key, b"".join(parts), etag)
        return 200, {}, self.xml("CompleteMultipartUploadResult", "<Key>%s</Key><ETag>%s</ETag>" % (escape(key), escape(etag)))

    @staticmethod
    def xml(name, inside):
        return ('<?xml version="1.0" encoding="UTF-8"?>\n<%s xmlns="http://s3.amazonaws.com/doc/2006-03-01/">%s</%s>' %
                (name, inside, name)).encode()

    def list_objects(self, names):
        if names.get("list-type") != "2":
            raise Refusal(400, "InvalidArgument", "only version 2 of the list is known here")
        prefix, page = names.get("prefix", ""), int(SETTINGS["page"])
        keys = sorted(k for k in OBJECTS if k.startswith(prefix) and k > names.get("continuation-token", ""))
        keys = [] if SETTINGS["stale"] else keys
        more = len(keys) > page
        inside = "<Name>%s</Name><Prefix>%s</Prefix><KeyCount>%d</KeyCount><IsTruncated>%s</IsTruncated>" % (
            SETTINGS["bucket"], escape(prefix), min(page, len(keys)), "true" if more else "false")
        if more:
            inside += "<NextContinuationToken>%s</NextContinuationToken>" % escape(keys[page - 1])
        for key in keys[:page]:
            body, etag, written = OBJECTS[key]
            inside += ("<Contents><Key>%s</Key><LastModified>%s</LastModified><ETag>%s</ETag><Size>%d</Size>"
                       "<StorageClass>STANDARD</StorageClass></Contents>" %
                       (escape(key), iso(written), escape(etag, {'"': "&quot;"}), len(body)))
        return 200, {}, self.xml("ListBucketResult", inside)

    def list_uploads(self, names):
        inside = "<IsTruncated>false</IsTruncated>"
        for upload, (key, _, begun) in sorted(UPLOADS.items()):
            if key.startswith(names.get("prefix", "")):
                inside += "<Upload><Key>%s</Key><UploadId>%s</UploadId><Initiated>%s</Initiated></Upload>" % (
                    escape(key), upload, iso(begun))
        return 200, {}, self.xml("ListMultipartUploadsResult", inside)

    def answer(self, status, headers, body):
        kind = self.fault["kind"] if self.fault else ""
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.send_header("x-amz-request-id", "4442587FB7D0A2F9")
        if status != 204:
            self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command == "HEAD" or status == 204:
            return
        if kind == "other_bytes" and body:
            body = bytes([body[0] ^ 1]) + body[1:]
        if kind in ("truncate", "stall"):
            self.wfile.write(body[:len(body) // 2])
            self.wfile.flush()
            if kind == "stall":
                time.sleep(float(self.fault["seconds"]))
            raise Dropped()
        if kind == "slow":
            for i in range(10):
                self.wfile.write(body[len(body) * i // 10:len(body) * (i + 1) // 10])
                self.wfile.flush()
                time.sleep(float(self.fault["seconds"]) / 10)
            return
        self.wfile.write(body)
        self.wfile.flush()

    def date_time_string(self, timestamp=None):
        return email.utils.formatdate(now() if timestamp is None else timestamp, usegmt=True)

    # ---- the test's side

    def control(self, path):
        body = self.read_body()
        with LOCK:
            if path == "/_control/log":
                answer = "\n".join(LOG)
                LOG.clear()
            elif path == "/_control/keys":
                answer = "\n".join(sorted(OBJECTS))
            elif path == "/_control/uploads":
                answer = str(len(UPLOADS))
            else:
                change = json.loads(body)
                for key in change.pop("damage", []):
                    old, etag, written = OBJECTS[key]
                    OBJECTS[key] = (old[:-1] + bytes([old[-1] ^ 1]), etag[:-1] + 'd"', written)
                for key in change.pop("age", []):  # makes all objects older by these seconds
                    for name, (old, etag, written) in OBJECTS.items():
                        OBJECTS[name] = (old, etag, written - key)
                    for upload in UPLOADS.values():
                        upload[2] -= key
                for key in change.pop("remove", []):
                    OBJECTS.pop(key, None)
                for key, text in change.pop("write", {}).items():
                    self.store(key, text.encode(), '"%s"' % hashlib.md5(text.encode()).hexdigest())
                SETTINGS.update(change)
                answer = "ok"
        self.answer(200, {}, answer.encode())


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 128


def main():
    for argument in sys.argv[2:]:
        name, value = argument.split("=", 1)
        SETTINGS[name] = value
    server = Server((SETTINGS["host"], int(os.environ.get("S3_PORT", "0"))), Handler)
    with open(sys.argv[1] + ".part", "w") as file:
        file.write(str(server.server_address[1]))
    os.rename(sys.argv[1] + ".part", sys.argv[1])
    server.serve_forever()


main()
