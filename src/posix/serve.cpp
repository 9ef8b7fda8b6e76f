#include "spindle/posix/serve.hpp"

#include "posix/listener.hpp"
#include "posix/serving.hpp"

namespace spindle::posix {

Result<void> serve_tcp(sim::Server& server, const ServeOptions& options, Clock& clock,
                       const Interrupt& interrupt) {
  Result<Listener> listener = listen_on(options.host, options.port, clock, interrupt);
  if (!listener) return tl::unexpected(std::move(listener.error()));
  if (options.listening) {
    Result<void> told = options.listening(listener->port);
    if (!told) return told;
  }
  Serving serving(Service{server, options}, clock, interrupt);
  serving.listen(std::move(listener->socket));
  serving.run();
  return {};
}

sim::Serve tool_server(Clock& clock, const Interrupt& interrupt) {
  return [&clock, &interrupt](sim::Server& server, const ServeOptions& options) {
    return options.pty.empty() ? serve_tcp(server, options, clock, interrupt)
                               : serve_pty(server, options, clock, interrupt);
  };
}

}  // namespace spindle::posix
