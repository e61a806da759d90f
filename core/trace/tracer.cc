#include "core/trace/tracer.h"

#include <unistd.h>

#include <utility>

#include "core/base/process/host_name.h"
#include "core/base/text/utf8.h"

namespace color3d {
namespace {

constexpr size_t kMaxMessageBytes = 1024;

}  // namespace

std::shared_ptr<Tracer> Tracer::Make(const TraceSettings& settings,
                                     const std::string& version,
                                     std::function<void(const std::string&)> on_problem) {
  if (settings.target.url.empty()) return nullptr;
  ExporterOptions options;
  options.target = settings.target;
  options.resource.scope = "color3d";
  options.resource.version = version;
  options.resource.attributes = {{"service.name", settings.service},
                                 {"service.version", version},
                                 {"host.name", HostName("")},
                                 {"process.pid", static_cast<int64_t>(::getpid())}};
  options.resource.attributes.insert(
      options.resource.attributes.end(), settings.attributes.begin(), settings.attributes.end());
  options.on_problem = std::move(on_problem);
  return std::shared_ptr<Tracer>(new Tracer(settings.sampler, std::move(options)));
}

TraceContext Tracer::Begin(const std::optional<TraceContext>& parent) const {
  TraceContext context;
  context.trace_id = parent ? parent->trace_id : NewTraceId();
  context.span_id = NewSpanId();
  context.sampled = sampler_.Samples(context.trace_id, parent);
  return context;
}

void Tracer::Record(Span span) {
  if (!span.context.sampled) return;
  span.status_message = CleanUtf8(span.status_message, kMaxMessageBytes);
  exporter_.Add(std::move(span));
}

}  // namespace color3d
