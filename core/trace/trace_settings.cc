#include "core/trace/trace_settings.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/base/error.h"
#include "core/base/text/lower_case.h"

namespace color3d {
namespace {

constexpr char kEndpoint[] = "OTEL_EXPORTER_OTLP_ENDPOINT";
constexpr char kTracesEndpoint[] = "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT";
constexpr char kSampler[] = "OTEL_TRACES_SAMPLER";
constexpr char kSamplerArgument[] = "OTEL_TRACES_SAMPLER_ARG";

using Pairs = std::vector<std::pair<std::string, std::string>>;

std::string Trimmed(std::string_view text) {
  const size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return "";
  return std::string(text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin));
}

int HexValue(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// Decodes "%41"; other text stays.
std::string PercentDecoded(std::string_view text) {
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? HexValue(text[i + 1]) : -1;
    const int low = high >= 0 ? HexValue(text[i + 2]) : -1;
    if (low < 0) {
      decoded += text[i];
      continue;
    }
    decoded += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return decoded;
}

// Reads "name=value,name=value" with percent-encoded values. Returns false if a part is malformed;
// the others are read.
bool ReadPairs(std::string_view text, Pairs* pairs) {
  bool good = true;
  while (!text.empty()) {
    const size_t comma = std::min(text.find(','), text.size());
    const std::string part = Trimmed(text.substr(0, comma));
    text.remove_prefix(std::min(comma + 1, text.size()));
    if (part.empty()) continue;
    const size_t equals = part.find('=');
    const std::string name = Trimmed(part.substr(0, equals));
    const std::string value =
        equals == std::string::npos ? "" : PercentDecoded(Trimmed(part.substr(equals + 1)));
    const bool has_control =
        std::ranges::any_of(name + value, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
    if (equals == std::string::npos || name.empty() || has_control) {
      good = false;
    } else {
      pairs->emplace_back(name, value);
    }
  }
  return good;
}

// Adds the path of traces to the address for all signals.
std::string WithTracesPath(const std::string& base) {
  return base + (base.ends_with('/') ? "v1/traces" : "/v1/traces");
}

class SettingsReader {
 public:
  explicit SettingsReader(const GetVariable& get) : get_(get) {}

  TraceSettings Read(const std::string& service, const std::string& endpoint) {
    settings_.service = service;
    if (!endpoint.empty()) CheckTraceEndpoint("--otlp-endpoint", endpoint);
    settings_.target.url = endpoint.empty() ? AddressOfEnvironment() : WithTracesPath(endpoint);
    if (LowerCase(Get("OTEL_SDK_DISABLED")) == "true" ||
        (endpoint.empty() && Get("OTEL_TRACES_EXPORTER") == "none")) {
      settings_.target.url.clear();
    }
    if (settings_.target.url.empty()) return std::move(settings_);
    ReadProtocol();
    ReadHeaders();
    ReadSampler();
    settings_.target.certificate = OfTraces("CERTIFICATE");
    const std::string limit = OfTraces("TIMEOUT");
    int limit_ms = 0;
    if (!limit.empty() && (!ReadNumber(limit, &limit_ms) || limit_ms < 1 || limit_ms > 600'000)) {
      Warn("OTEL_EXPORTER_OTLP_TIMEOUT is '{}'; the range is 1 to 600000 ms", limit);
    } else if (!limit.empty()) {
      settings_.target.limit = std::chrono::milliseconds(limit_ms);
    }
    ReadResource();
    return std::move(settings_);
  }

 private:
  std::string Get(const std::string& name) const { return Trimmed(get_(name.c_str())); }
  // A variable of traces, else that of all signals.
  std::string OfTraces(const std::string& name) const {
    const std::string own = Get("OTEL_EXPORTER_OTLP_TRACES_" + name);
    return own.empty() ? Get("OTEL_EXPORTER_OTLP_" + name) : own;
  }
  template <typename... Arguments>
  void Warn(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
    settings_.warnings.push_back(fmt::format(text, std::forward<Arguments>(arguments)...));
  }
  template <typename Number>
  static bool ReadNumber(const std::string& text, Number* number) {
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, *number);
    return error == std::errc() && stop == end;
  }

  // The address of traces is used as it is.
  std::string AddressOfEnvironment() {
    for (const char* name : {kTracesEndpoint, kEndpoint}) {
      const std::string url = Get(name);
      if (url.empty()) continue;
      try {
        CheckTraceEndpoint(name, url);
      } catch (const Error& e) {
        Warn("{}; traces are not exported", std::string(e.what()));
        return "";
      }
      return std::string_view(name) == kTracesEndpoint ? url : WithTracesPath(url);
    }
    return "";
  }

  void ReadProtocol() {
    const std::string protocol = OfTraces("PROTOCOL");
    if (protocol != "grpc") return;
    Warn("OTEL_EXPORTER_OTLP_PROTOCOL is grpc; traces are sent as http/json to {}",
         settings_.target.url);
  }

  void ReadHeaders() {
    if (!ReadPairs(OfTraces("HEADERS"), &settings_.target.headers)) {
      // Without the value, which may be secret.
      Warn("OTEL_EXPORTER_OTLP_HEADERS has a part that is not NAME=VALUE, which is ignored");
    }
  }

  void ReadSampler() {
    const std::string name = Get(kSampler);
    TraceSampler& sampler = settings_.sampler;
    constexpr std::string_view kParentBased = "parentbased_";
    sampler.follows_parent = name.empty() || name.starts_with(kParentBased);
    const std::string root =
        name.starts_with(kParentBased) ? name.substr(kParentBased.size()) : name;
    if (root == "always_off") {
      sampler.ratio = 0.0;
    } else if (root == "traceidratio") {
      const std::string ratio = Get(kSamplerArgument);
      double value = 1.0;
      if (!ratio.empty() && !(ReadNumber(ratio, &value) && value >= 0.0 && value <= 1.0)) {
        Warn("{} is '{}'; the range is 0 to 1; all traces are sampled", kSamplerArgument, ratio);
        value = 1.0;
      }
      sampler.ratio = value;
    } else if (!name.empty() && root != "always_on") {
      Warn("{} is '{}', which is not known; parentbased_always_on is used", kSampler, name);
      sampler = {};
    }
  }

  void ReadResource() {
    Pairs pairs;
    if (!ReadPairs(Get("OTEL_RESOURCE_ATTRIBUTES"), &pairs)) {
      Warn("OTEL_RESOURCE_ATTRIBUTES has a part that is not NAME=VALUE; all are ignored");
      pairs.clear();
    }
    for (auto& [name, value] : pairs) {
      if (name == "service.name") {
        settings_.service = value;
      } else {
        settings_.attributes.emplace_back(name, value);
      }
    }
    const std::string service = Get("OTEL_SERVICE_NAME");
    if (!service.empty()) settings_.service = service;
  }

  const GetVariable& get_;
  TraceSettings settings_;
};

}  // namespace

bool TraceSampler::Samples(const std::string& trace_id,
                           const std::optional<TraceContext>& parent) const {
  if (follows_parent && parent) return parent->sampled;
  if (ratio >= 1.0) return true;
  // The last 56 bits, which are random: all processes with this ratio decide alike.
  const std::string_view digits = std::string_view(trace_id).substr(trace_id.size() - 14);
  uint64_t value = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  return std::ldexp(static_cast<double>(value), -56) < ratio;
}

std::string VariableOfProcess(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

TraceSettings ReadTraceSettings(const std::string& service,
                                const std::string& endpoint,
                                const GetVariable& get) {
  return SettingsReader(get).Read(service, endpoint);
}

void CheckTraceEndpoint(const std::string& source, const std::string& url) {
  const size_t scheme = url.starts_with("http://")    ? 7
                        : url.starts_with("https://") ? 8
                                                      : std::string::npos;
  const std::string rest = scheme == std::string::npos ? "" : url.substr(scheme);
  const std::string authority = rest.substr(0, rest.find_first_of("/?#"));
  if (authority.find('@') != std::string::npos) {
    throw InvalidArgument(
        "{} has a user or password; leave it out and set OTEL_EXPORTER_OTLP_HEADERS", source);
  }
  const bool is_printable =
      std::ranges::all_of(url, [](unsigned char c) { return c > 0x20 && c < 0x7f; });
  const size_t host = authority.starts_with('[') ? authority.find(']') : authority.find(':');
  if (authority.empty() || host == 0 || !is_printable ||
      rest.find_first_of("?#") != std::string::npos) {
    throw InvalidArgument(
        "{} is '{}'; an address like http://127.0.0.1:4318 is required", source, url);
  }
}

}  // namespace color3d
