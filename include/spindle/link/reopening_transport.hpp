#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "spindle/link/session.hpp"
#include "spindle/link/trace.hpp"
#include "spindle/link/transport.hpp"

namespace spindle::link {

/// Whether a connection that the server closed is opened once more.
enum class Reopening : std::uint8_t { never, once };

/// Modbus TCP to a server that hangs up, as some do behind every answer. A closed connection is
/// opened anew, and what was asked is sent again: a read whose answer did not come whole, once;
/// anything else only where the connection was closed before it was sent, so that nothing is done
/// twice. What changes something therefore gets a new connection, once the server was seen to hang
/// up behind an answer. Gives up where the connection before brought nothing either; then the error
/// is that of the closed connection.
class ReopeningTransport final : public Transport {
 public:
  using Open = std::function<Result<std::unique_ptr<Transport>>()>;

  ReopeningTransport(std::unique_ptr<Transport> transport, Open open, const Clock& clock,
                     Trace trace);

  Result<void> send(ByteView bytes, TimePoint deadline) override;
  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override;
  void set_uninterruptible() override;
  void set_interruptible() override;
  void introduce(const SessionOptions& options) override;
  [[nodiscard]] bool asks_owner() const override { return transport_ && transport_->asks_owner(); }
  void set_urgent() override {
    if (transport_) transport_->set_urgent();
  }
  void skip_verification() override {
    if (transport_) transport_->skip_verification();
  }

 private:
  Result<std::size_t> take(TimePoint deadline);
  Result<void> reopen(Error why);
  Result<void> ask_again(Error why, TimePoint deadline);
  std::size_t hand_over(std::span<std::uint8_t> into, std::size_t size);
  [[nodiscard]] std::size_t whole() const;
  void note_answer(ByteView frames);

  std::unique_ptr<Transport> transport_;  ///< empty: it could not be opened
  Open open_;
  const Clock* clock_;
  Trace trace_;
  Bytes request_ = {};            ///< the last one, while its answer is awaited
  Bytes held_ = {};               ///< received, and not handed over: the last frame may be in part
  bool brought_nothing_ = false;  ///< this connection, which was opened anew
  bool hangs_up_ = false;         ///< the server has closed a connection behind an answer
  bool asked_again_ = false;      ///< the last request
  bool shielded_ = false;
  std::optional<SessionOptions> introduced_ = std::nullopt;
};

}  // namespace spindle::link
