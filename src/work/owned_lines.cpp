#include "spindle/work/owned_lines.hpp"

#include <fmt/format.h>

#include <utility>

namespace spindle::work {
namespace {

/// One for each line: the connection that several units share, or host and port. A port that is the
/// profile's is not known from the beginning.
std::string key_of(const link::Endpoint& endpoint, std::uint16_t port) {
  const std::string shared = shared_connection(endpoint);
  if (!shared.empty()) return fmt::format("{} {}", static_cast<int>(endpoint.medium), shared);
  if (endpoint.medium != link::Medium::tcp) return {};
  return fmt::format("{}:{}", endpoint.host, port);
}

Error no_single_line(std::size_t lines) {
  return {.code = Errc::usage,
          .message = lines == 0 ? "--listen is for a tool on a line or network, and this is none"
                                : fmt::format(
                                      "--listen is for one tool, or for the units of one line, and "
                                      "these are {} lines",
                                      lines),
          .hint = lines == 0 ? "'spindle simulate --listen' serves a simulated tool"
                             : "serve each with a port of its own"};
}

}  // namespace

OwnedLines::OwnedLines(const std::vector<Target>& targets, const Environment& environment,
                       Note note)
    : environment_(&environment), note_(std::move(note)) {
  std::map<std::string, std::size_t> counts;
  for (const Target& target : targets) {
    ++counts[key_of(target.endpoint, target.endpoint.port.value_or(0))];
  }
  for (const Target& target : targets) {
    const link::Endpoint& endpoint = target.endpoint;
    const std::string key = key_of(endpoint, endpoint.port.value_or(0));
    // The same tool twice: what it sends unasked, each wants on a connection of its own.
    const bool is_alone = !shared_connection(endpoint).empty() || counts[key] == 1;
    if (!key.empty() && is_alone) {
      add(key, endpoint);
      continue;
    }
    ++unowned_;
    several_.insert(key);
  }
}

OwnedLines::~OwnedLines() {
  for (const auto& [key, entry] : lines_) {
    entry->line.close({.code = Errc::terminated, .message = "the program that has the line ends"});
  }
  doors_.reset();
}

/// Called with the mutex locked, or before there are threads.
OwnedLines::Line& OwnedLines::add(const std::string& key, const link::Endpoint& endpoint) {
  const bool is_gateway = !endpoint.gateway.empty();
  const auto stays = is_gateway ? link::Stays::while_answering : link::Stays::while_shared;
  auto& line = lines_[key];
  if (!line) line = std::make_unique<Line>(environment_->clock, stays);
  return *line;
}

OwnedLines::Line* OwnedLines::line_of(const link::Endpoint& endpoint) {
  const std::lock_guard lock(mutex_);
  auto found = lines_.find(key_of(endpoint, endpoint.port.value_or(0)));
  if (found == lines_.end()) found = lines_.find(key_of(endpoint, 0));
  return found == lines_.end() ? nullptr : found->second.get();
}

device::OpenTransport OwnedLines::opener() {
  return [this](const link::Endpoint& endpoint, const catalogue::LinkSpec& facts,
                Duration connect_timeout) -> Result<std::unique_ptr<link::Transport>> {
    Line* const owned = line_of(endpoint);
    if (owned == nullptr) return environment_->open(endpoint, facts, connect_timeout);
    std::string name;
    auto share = owned->line.join([&] {
      auto opened = environment_->open(endpoint, facts, connect_timeout);
      if (opened) name = (*opened)->line_name();
      return opened;
    });
    if (share && !name.empty()) {
      owned->line.when_introduced([this, name, owned] { announce(name, *owned); });
    }
    return share;
  };
}

void OwnedLines::announce(const std::string& name, Line& line) {
  const std::lock_guard lock(mutex_);
  line.door = name;
  if (doors_) open_door(line);
}

/// Called with the mutex locked.
void OwnedLines::open_door(Line& line) {
  const auto opened = doors_->open(line.door, line.line);
  if (opened || std::exchange(is_noted_, true)) return;
  note_(message_of(opened.error()));
}

void OwnedLines::open_doors() {
  const std::lock_guard lock(mutex_);
  if (doors_ || !environment_->make_doors) return;
  doors_ = environment_->make_doors();
  for (const auto& [key, line] : lines_) {
    if (!line->door.empty()) open_door(*line);
  }
}

OwnedLines::Stay::Stay(OwnedLines& lines, const link::Endpoint& endpoint)
    : lines_(&lines), key_(key_of(endpoint, endpoint.port.value_or(0))) {
  lines_->come(key_, endpoint);
}

OwnedLines::Stay::~Stay() { lines_->go(key_); }

void OwnedLines::come(const std::string& key, const link::Endpoint& endpoint) {
  const std::lock_guard lock(mutex_);
  if (key.empty() || several_.contains(key)) return;
  ++add(key, endpoint).tools;
}

void OwnedLines::go(const std::string& key) {
  Line* left = nullptr;
  {
    const std::lock_guard lock(mutex_);
    const auto found = lines_.find(key);
    if (found == lines_.end() || --found->second->tools > 0) return;
    left = found->second.get();
    if (doors_ && !left->door.empty()) doors_->close(left->door);
  }
  left->line.close_unused(
      {.code = Errc::closed, .message = "the program that had the line let go of it"});
}

Result<std::uint16_t> OwnedLines::listen(const std::string& host, std::uint16_t port,
                                         link::Rights rights) {
  if (lines_.size() != 1 || unowned_ > 0) {
    return tl::unexpected(no_single_line(lines_.empty() ? 0 : lines_.size() + unowned_));
  }
  open_doors();
  const std::lock_guard lock(mutex_);
  if (!doors_) {
    return tl::unexpected(
        Error{.code = Errc::internal, .message = "this program cannot be asked by others"});
  }
  return doors_->listen(host, port, lines_.begin()->second->line, rights);
}

}  // namespace spindle::work
