#pragma once

#include <httplib.h>

#include <optional>
#include <string>

#include "page/site.hpp"

namespace spindle::page {

/// The connection of one request, as the library sees it. An answer is kept until it is whole; that
/// of a stream goes out at once.
class Wire final : public httplib::Stream {
 public:
  Wire(int socket, std::string_view head, const Clock& clock)
      : socket_(socket), unread_(head), clock_(&clock) {}

  [[nodiscard]] bool is_readable() const override { return !unread_.empty(); }
  [[nodiscard]] bool is_writable() const override { return !is_broken_; }
  ssize_t read(char* bytes, std::size_t size) override;
  ssize_t write(const char* bytes, std::size_t size) override;
  void get_remote_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  void get_local_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  [[nodiscard]] socket_t socket() const override { return socket_; }

  /// From now on nothing is kept.
  bool begin_stream();
  [[nodiscard]] bool is_stream() const { return is_stream_; }
  [[nodiscard]] std::string take_answer() { return std::move(answer_); }

 private:
  int socket_;
  std::string_view unread_;
  const Clock* clock_;
  std::string answer_ = {};
  bool is_stream_ = false;
  bool is_broken_ = false;
};

/// Answers one request: the library reads it and writes the answer, what is in it is decided here.
class Answer final : public httplib::Server {
 public:
  Answer(Wire& wire, const SiteFacts& facts, Live& live, Streams& streams,
         commands::Context& context);

  void give();

 private:
  void route(const httplib::Request& request, httplib::Response& response);
  bool is_let_in(const httplib::Request& request, httplib::Response& response) const;
  void open_stream(const httplib::Request& request, httplib::Response& response);
  bool go_on(httplib::DataSink& sink);
  bool join(httplib::DataSink& sink);
  bool replay(const Position& until, httplib::DataSink& sink);

  Wire* wire_;
  const SiteFacts* facts_;
  Live* live_;
  Streams* streams_;
  commands::Context* context_;
  std::optional<Streams::Ticket> ticket_ = std::nullopt;
  std::optional<Position> told_ = std::nullopt;  ///< up to where the client was told everything
  std::optional<Live::Place> place_ = std::nullopt;
  std::optional<std::uint64_t> store_ = std::nullopt;  ///< of which that is
  TimePoint beat_due_ = {};
};

}  // namespace spindle::page
