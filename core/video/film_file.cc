#include "core/video/film_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// FFmpeg's names of the containers behind kFilmEndings (catalogue/scene_files.h), and of raw
// streams with such extensions. None of these demuxers needs a second file.
constexpr std::string_view kContainers[] = {"mov,mp4,m4a,3gp,3g2,mj2",
                                            "matroska,webm",
                                            "avi",
                                            "dv",
                                            "mpeg",
                                            "mpegts",
                                            "mxf",
                                            "flv",
                                            "ogg",
                                            "asf",
                                            "mpegvideo",
                                            "m4v",
                                            "h264",
                                            "hevc"};

// File types that refer to a film but contain none.
constexpr std::string_view kLists[] = {
    "hls", "dash", "webm_dash_manifest", "concat", "sdp", "rtsp", "imf"};
constexpr std::string_view kSounds[] = {
    "wav", "w64", "mp3", "aac", "flac", "ac3", "eac3", "dts", "aiff", "au", "caf", "amr"};

template <size_t N>
bool IsOneOf(const std::string_view (&names)[N], std::string_view name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

int RefuseSecondFile(AVFormatContext*, AVIOContext** opened, const char*, int, AVDictionary**) {
  *opened = nullptr;
  return AVERROR(EACCES);
}

int IsCancelled(void* token) {
  const auto* cancel = static_cast<const CancellationToken*>(token);
  return cancel != nullptr && cancel->IsCancelled() ? 1 : 0;
}

}  // namespace

void RefuseFilm(const fs::path& file, const std::string& why) {
  throw InvalidArgument("{} is no film that can be read: {}", file.filename().string(), why);
}

// File access for FFmpeg's libraries.
class FilmFile::Bytes {
 public:
  Bytes(const fs::path& file, const CancellationToken* cancel) : cancel_(cancel) {
    // Does not block on a pipe.
    descriptor_ = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat facts {};
    if (descriptor_ < 0 || fstat(descriptor_, &facts) != 0 || !S_ISREG(facts.st_mode)) {
      Close();
      throw Error(ErrorCode::kNotFound, "there is no film {}", file.string());
    }
    constexpr int kBufferBytes = 1 << 15;
    auto* buffer = static_cast<unsigned char*>(av_malloc(kBufferBytes));
    if (buffer != nullptr) {
      context_ = avio_alloc_context(
          buffer, kBufferBytes, /*write_flag=*/0, this, &Bytes::Read, nullptr, &Bytes::Seek);
    }
    if (context_ != nullptr) return;
    av_free(buffer);
    Close();
    throw Error(ErrorCode::kResourceExhausted, "no memory to read {}", file.filename().string());
  }
  ~Bytes() {
    av_freep(&context_->buffer);  // the libraries may have replaced it
    avio_context_free(&context_);
    Close();
  }
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;

  AVIOContext* context() const { return context_; }

 private:
  static int Read(void* bytes, uint8_t* buffer, int size) {
    const auto* self = static_cast<Bytes*>(bytes);
    while (true) {
      if (IsCancelled(const_cast<CancellationToken*>(self->cancel_)) != 0) return AVERROR_EXIT;
      const ssize_t count = read(self->descriptor_, buffer, static_cast<size_t>(size));
      if (count > 0) return static_cast<int>(count);
      if (count == 0) return AVERROR_EOF;
      if (errno != EINTR) return AVERROR(errno);
    }
  }

  static int64_t Seek(void* bytes, int64_t offset, int whence) {
    const int descriptor = static_cast<Bytes*>(bytes)->descriptor_;
    if ((whence & AVSEEK_SIZE) != 0) {
      struct stat facts {};
      return fstat(descriptor, &facts) == 0 ? facts.st_size : AVERROR(errno);
    }
    const off_t place = lseek(descriptor, offset, whence & ~AVSEEK_FORCE);
    return place < 0 ? AVERROR(errno) : place;
  }

  void Close() {
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = -1;
  }

  const CancellationToken* const cancel_;
  int descriptor_ = -1;
  AVIOContext* context_ = nullptr;
};

FilmFile::FilmFile(const fs::path& file, const CancellationToken* cancel)
    : file_(file), cancel_(cancel) {
  av_log_set_level(AV_LOG_FATAL);
  ThrowIfCancelled();
  bytes_ = std::make_unique<Bytes>(file, cancel);
  const AVInputFormat* kind = nullptr;
  const std::string name = file.filename().string();
  if (const int result = av_probe_input_buffer2(
          bytes_->context(), &kind, name.c_str(), nullptr, /*offset=*/0, /*max_probe_size=*/0);
      result < 0) {
    RefuseContainer(result);
  }
  CheckKind(kind);
  AVFormatContext* container = avformat_alloc_context();
  if (container == nullptr) RefuseContainer(AVERROR(ENOMEM));
  container->pb = bytes_->context();
  container->io_open = &RefuseSecondFile;
  container->interrupt_callback = {&IsCancelled, const_cast<CancellationToken*>(cancel)};
  container->format_whitelist = av_strdup(kind->name);
  container->protocol_whitelist = av_strdup("file");
  // On failure FFmpeg frees it.
  if (const int result = avformat_open_input(&container, name.c_str(), kind, nullptr); result < 0) {
    RefuseContainer(result);
  }
  container_.reset(container);
  CheckSizes();
  FindStreams();
  ThrowIfCancelled();
}

void FilmFile::CheckSizes() const {
  for (unsigned i = 0; i < container_->nb_streams; ++i) {
    const AVStream& stream = *container_->streams[i];
    const AVCodecParameters& codec = *stream.codecpar;
    if (codec.codec_type != AVMEDIA_TYPE_VIDEO ||
        (stream.disposition & AV_DISPOSITION_ATTACHED_PIC) != 0 ||
        std::max(codec.width, codec.height) <= kMaxFilmSidePx) {
      continue;
    }
    RefuseFilm(file_,
               fmt::format("its frames are {} x {} px; up to {} px are taken",
                           codec.width,
                           codec.height,
                           kMaxFilmSidePx));
  }
}

// Frames that are decoded on the way are no larger than others.
void FilmFile::FindStreams() {
  for (unsigned i = 0; i < container_->nb_streams; ++i) {
    ranges_.push_back(container_->streams[i]->codecpar->color_range);
  }
  std::vector<AVDictionary*> options(container_->nb_streams, nullptr);
  for (AVDictionary*& of_stream : options) {
    av_dict_set_int(&of_stream, "max_pixels", kMaxFilmPixels, 0);
  }
  const int result = avformat_find_stream_info(container_.get(), options.data());
  for (AVDictionary*& of_stream : options) av_dict_free(&of_stream);
  if (result < 0) RefuseContainer(result);
  // For streams found later the container states nothing.
  ranges_.resize(container_->nb_streams, AVCOL_RANGE_UNSPECIFIED);
  CheckSizes();
}

FilmFile::~FilmFile() = default;

void FilmFile::ReadOnly(const AVStream* stream) {
  for (unsigned i = 0; i < container_->nb_streams; ++i) {
    if (container_->streams[i] != stream) container_->streams[i]->discard = AVDISCARD_ALL;
  }
}

bool FilmFile::ReadPacket(AVPacket* packet) {
  ThrowIfCancelled();
  if (av_read_frame(container_.get(), packet) >= 0) return true;
  ThrowIfCancelled();
  return false;
}

void FilmFile::CheckKind(const AVInputFormat* kind) const {
  const std::string_view name = kind->name;
  if (IsOneOf(kContainers, name)) return;
  const std::string called = kind->long_name != nullptr ? kind->long_name : kind->name;
  if (IsOneOf(kLists, name)) {
    RefuseFilm(file_,
               fmt::format("it is a list of other files ({}), and those are not opened; save the "
                           "film as one file, e.g. `ffmpeg -i LIST -c copy film.mkv`",
                           called));
  }
  if (IsOneOf(kSounds, name)) RefuseFilm(file_, fmt::format("it has only sound ({})", called));
  if (name == "gif" || name == "apng") {
    RefuseFilm(file_,
               fmt::format("it is an animated picture ({}); make a film of it, e.g. `ffmpeg -i {} "
                           "-c:v ffv1 film.mkv`",
                           called,
                           file_.filename().string()));
  }
  if (name == "image2" || name.ends_with("_pipe")) {
    RefuseFilm(file_,
               fmt::format("it is a picture ({}); give the folder of all frames with --film, as "
                           "JPEG, PNG or TIFF",
                           called));
  }
  RefuseFilm(file_,
             fmt::format("it is of a kind that is not taken ({}); save it as .mp4 or .mkv, e.g. "
                         "`ffmpeg -i {} -c copy film.mkv`",
                         called,
                         file_.filename().string()));
}

void FilmFile::RefuseContainer(int libav_result) const {
  ThrowIfCancelled();
  RefuseFilm(file_,
             LibavError(libav_result) +
                 "; it may be damaged or cut short: try another copy, or save it as .mp4 with a "
                 "program that plays it");
}

void FilmFile::ThrowIfCancelled() const {
  if (cancel_ != nullptr) cancel_->ThrowIfCancelled();
}

}  // namespace color3d
