#include "page/site.hpp"

#include <sys/socket.h>

#include <utility>

#include "page/answer.hpp"

namespace spindle::page {
namespace {

/// Streams, and room for those who only ask.
constexpr std::size_t threads = 64;

constexpr std::string_view not_allowed =
    "HTTP/1.1 405 Method Not Allowed\r\nAllow: GET, HEAD\r\nContent-Length: 0\r\nConnection: "
    "close\r\n\r\n";

}  // namespace

// ---- streams ----

int Streams::add(int socket) {
  const std::lock_guard lock(mutex_);
  // All tablets of a line come back at once: those that they broke off make room at once.
  if (sockets_.size() >= most && std::erase_if(sockets_, is_gone) > 0) live_->nudge();
  if (is_over_ || sockets_.size() >= most) return -1;
  end_when_unheard(socket);
  sockets_.insert(socket);
  return socket;
}

void Streams::remove(int socket) {
  const std::lock_guard lock(mutex_);
  sockets_.erase(socket);
}

std::size_t Streams::count() {
  const std::lock_guard lock(mutex_);
  return sockets_.size();
}

void Streams::end() {
  const std::lock_guard lock(mutex_);
  is_over_ = true;
  for (const int socket : sockets_) ::shutdown(socket, SHUT_RDWR);
}

// ---- the site ----

/// The threads that answer. What they are given is kept here: a task of the library is copied.
class Site::Pool {
 public:
  explicit Pool(Site& site) : site_(&site), threads_(threads) {}

  void add(Arrival arrival) {
    {
      const std::lock_guard lock(mutex_);
      arrivals_.push_back(std::move(arrival));
    }
    threads_.enqueue([this] { site_->answer(take()); });
  }
  void end() { threads_.shutdown(); }

 private:
  Arrival take() {
    const std::lock_guard lock(mutex_);
    Arrival first = std::move(arrivals_.front());
    arrivals_.pop_front();
    return first;
  }

  Site* site_;
  std::mutex mutex_ = {};
  std::deque<Arrival> arrivals_ = {};
  httplib::ThreadPool threads_;
};

Site::Site(Socket listener, SiteFacts facts, Live& live, commands::Context& context)
    : facts_(std::move(facts)),
      live_(&live),
      context_(&context),
      streams_(live),
      pool_(std::make_unique<Pool>(*this)),
      door_(std::move(listener), context.clock,
            [this](Arrival arrival) { pool_->add(std::move(arrival)); }),
      doorman_([this] { door_.run(); }) {}

Site::~Site() { stop(); }

void Site::stop() {
  if (!doorman_.joinable()) return;
  door_.stop();
  doorman_.join();
  live_->close();
  streams_.end();
  pool_->end();
}

void Site::answer(Arrival arrival) {
  const bool is_known = arrival.head.starts_with("GET ") || arrival.head.starts_with("HEAD ");
  if (!is_known) return door_.send_off(std::move(arrival.socket), std::string(not_allowed));
  Wire wire(arrival.socket.get(), arrival.head, context_->clock);
  Answer(wire, facts_, *live_, streams_, *context_).give();
  if (!wire.is_stream()) door_.send_off(std::move(arrival.socket), wire.take_answer());
}

}  // namespace spindle::page
