#include "page/answer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "page/quiet.hpp"
#include "page/store_poll.hpp"
#include "page/view.hpp"

namespace spindle::page {
namespace {

using httplib::Request;
using httplib::Response;

constexpr Duration send_patience = std::chrono::seconds(10);
constexpr Duration beat_every = std::chrono::seconds(10);
/// How long it may take until it is seen that a client has gone.
constexpr auto look_every = std::chrono::milliseconds(2000);
constexpr std::string_view cookie = "spindle";

constexpr std::string_view html = "text/html; charset=utf-8";
constexpr std::string_view policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

void add_headers(Response& response) {
  response.set_header("Content-Security-Policy", std::string(policy));
  response.set_header("X-Content-Type-Options", "nosniff");
  response.set_header("Referrer-Policy", "no-referrer");
  response.set_header("Cross-Origin-Resource-Policy", "same-origin");
  response.set_header("Cross-Origin-Opener-Policy", "same-origin");
  response.set_header("Cache-Control", "no-store");
}

void refuse(Response& response, int status, std::string_view title, std::string_view sentence) {
  response.status = status;
  response.set_content(sentence_html(title, sentence), std::string(html));
}

void show(Response& response, std::string text, std::string_view type) {
  response.status = 200;
  response.set_content(std::move(text), std::string(type));
}

}  // namespace

// ---- the wire ----

ssize_t Wire::read(char* bytes, std::size_t size) {
  const std::size_t length = std::min(size, unread_.size());
  std::memcpy(bytes, unread_.data(), length);
  unread_.remove_prefix(length);
  return static_cast<ssize_t>(length);
}

ssize_t Wire::write(const char* bytes, std::size_t size) {
  if (!is_stream_) {
    answer_.append(bytes, size);
    return static_cast<ssize_t>(size);
  }
  is_broken_ = is_broken_ || !send_all(socket_, {bytes, size}, send_patience, *clock_);
  return is_broken_ ? -1 : static_cast<ssize_t>(size);
}

bool Wire::begin_stream() {
  if (is_stream_) return !is_broken_;
  is_stream_ = true;
  const std::string head = std::move(answer_);
  return write(head.data(), head.size()) >= 0;
}

// ---- the answer ----

Answer::Answer(Wire& wire, const SiteFacts& facts, Live& live, Streams& streams,
               commands::Context& context)
    : wire_(&wire), facts_(&facts), live_(&live), streams_(&streams), context_(&context) {
  svr_sock_ = wire.socket();  // the library takes a server without one for one that ends
  set_pre_routing_handler([this](const Request& request, Response& response) {
    add_headers(response);
    route(request, response);
    return HandlerResponse::Handled;
  });
  set_exception_handler([](const Request&, Response& response, std::exception_ptr) {
    refuse(response, 500, "Internal error", "The page could not be made.");
  });
}

void Answer::give() {
  bool is_closed = false;
  process_request(*wire_, true, is_closed, [](Request& request) {
    request.ranges.clear();
    request.headers.erase("Accept-Encoding");
  });
}

void Answer::route(const Request& request, Response& response) {
  if (request.method != "GET" && request.method != "HEAD") {
    response.set_header("Allow", "GET, HEAD");
    return refuse(response, 405, "Not allowed", "This page is for reading only.");
  }
  if (!is_let_in(request, response)) return;
  if (request.path == "/") return show(response, live_->page(), html);
  if (request.path == "/style.css") {
    return show(response, std::string(style_css()), "text/css; charset=utf-8");
  }
  if (request.path == "/app.js") {
    return show(response, std::string(script_js()), "text/javascript; charset=utf-8");
  }
  if (request.path == "/icon.svg") return show(response, std::string(icon_svg()), "image/svg+xml");
  if (request.path == "/api/state") return show(response, live_->state(), "application/json");
  if (request.path == "/metrics") {
    return show(response, live_->metrics(streams_->count()),
                "text/plain; version=0.0.4; charset=utf-8");
  }
  if (request.path == "/events") return open_stream(request, response);
  refuse(response, 404, "Not found", "There is no such page.");
}

bool Answer::is_let_in(const Request& request, Response& response) const {
  const std::string& token = facts_->token;
  if (token.empty()) {
    // Another site whose name leads here must not read it through the user's browser.
    if (!is_loopback(facts_->place) ||
        is_local_host(request.get_header_value("Host"), facts_->place.address)) {
      return true;
    }
    refuse(response, 421, "Not this name", "This page is asked for by a name that is not its own.");
    return false;
  }
  if (is_same_secret(bearer_of(request.get_header_value("Authorization")), token)) return true;
  if (is_same_secret(cookie_of(request.get_header_value("Cookie"), cookie), token)) return true;
  if (is_same_secret(query_value(request.target, "token"), token)) {
    response.status = 303;
    response.set_header("Location", "/");
    constexpr int days_90 = 90 * 24 * 60 * 60;
    response.set_header("Set-Cookie",
                        fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}", cookie,
                                    token, days_90));
    return false;
  }
  response.set_header("WWW-Authenticate", "Bearer realm=\"spindle\"");
  refuse(response, 401, "A token is needed",
         "Open this page once as /?token=TOKEN, with the token of the file that was given to "
         "spindle serve.");
  return false;
}

// ---- streams ----

void Answer::open_stream(const Request& request, Response& response) {
  told_ = parse_position(request.get_header_value("Last-Event-ID"));
  if (!told_) told_ = parse_position(query_value(request.target, "after"));
  if (request.method == "HEAD") return show(response, {}, "text/event-stream");
  ticket_.emplace(*streams_, wire_->socket());
  if (!ticket_->is_granted()) {
    response.set_header("Retry-After", "5");
    return refuse(response, 503, "Too many streams",
                  fmt::format("There are {} streams of events already.", Streams::most));
  }
  response.status = 200;
  response.set_chunked_content_provider("text/event-stream",
                                        [this](std::size_t, httplib::DataSink& sink) {
                                          return wire_->begin_stream() && go_on(sink);
                                        });
}

/// One piece of a stream; false ends it.
bool Answer::go_on(httplib::DataSink& sink) {
  if (!place_) return join(sink);
  const Live::Batch batch = live_->wait(*place_, look_every);
  if (batch.is_over || is_gone(wire_->socket())) return false;
  if (batch.is_late) {
    told_ = place_->position;
    place_.reset();
    return true;
  }
  std::string text = batch.text;
  if (context_->clock.now() >= beat_due_) text += live_->beat();
  if (text.empty()) return true;
  beat_due_ = context_->clock.now() + beat_every;
  return sink.write(text.data(), text.size());
}

/// What was missed, then all that is the case now.
bool Answer::join(httplib::DataSink& sink) {
  const auto [view, place] = live_->join();
  constexpr std::string_view retry = "retry: 3000\n\n";
  if (!sink.write(retry.data(), retry.size())) return false;
  // Of another store in the same place everything is new.
  if (store_ && *store_ != place.store) told_ = Position();
  store_ = place.store;
  if (told_ && *told_ != place.position && is_within(*told_, place.position)) {
    if (!replay(place.position, sink)) return false;
  }
  place_ = place;
  beat_due_ = context_->clock.now() + beat_every;
  return sink.write(view.data(), view.size());
}

bool Answer::replay(const Position& until, httplib::DataSink& sink) {
  constexpr std::size_t part = 64U << 10U;
  QuietContext context(*context_);
  auto rows = commands::StoredRows::open(facts_->store, context.get());
  if (!rows) return false;
  std::string text;
  bool is_sent = true;
  const auto read = rows_between(**rows, *told_, until, [&](const Live::Told& row) {
    text += frame("record", row.position, row.json);
    if (text.size() < part) return true;
    is_sent = sink.write(text.data(), text.size());
    text.clear();
    return is_sent;
  });
  return read && is_sent && (text.empty() || sink.write(text.data(), text.size()));
}

}  // namespace spindle::page
