// SPDX-License-Identifier: MIT
#include "tools/prismweb/lane.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <charconv>
#include <utility>
#include <vector>

#include "tools/prismweb/awaiting.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;

constexpr std::size_t kMostLineBytes = 32 << 20, kMostQuestions = 256;

// {"jsonrpc":"2.0","id":17,"result":…} → 17 and `"result":…`.
bool split_answer(std::string_view line, std::uint64_t& id, std::string_view& member) {
  constexpr std::string_view kHead = R"({"jsonrpc":"2.0","id":)";
  if (!line.starts_with(kHead) || !line.ends_with('}')) return false;
  const char* const first = line.data() + kHead.size();
  const auto [end, error] = std::from_chars(first, line.data() + line.size(), id);
  if (error != std::errc() || end == line.data() + line.size() || *end != ',') return false;
  member = line.substr(static_cast<std::size_t>(end + 1 - line.data()));
  member.remove_suffix(1);
  return true;
}

}  // namespace

Lane::Lane(asio::io_context& io, std::string path) : io_(io), path_(std::move(path)), socket_(io) {}

asio::awaitable<bool> Lane::connect() {
  socket_ = Protocol::socket(io_);
  const Protocol::endpoint there(path_);
  const auto [error] = co_await socket_.async_connect(there, kUse);
  if (!error) next();
  co_return !error;
}

asio::awaitable<void> Lane::read(Other other) {
  std::string pending;
  std::vector<char> buffer(256 << 10);
  const auto room = asio::buffer(buffer);
  for (std::size_t searched = 0;;) {
    const auto [error, size] = co_await socket_.async_read_some(room, kUse);
    if (error) break;
    pending.append(buffer.data(), size);
    std::size_t begin = 0;
    for (std::size_t end; (end = pending.find('\n', std::max(begin, searched))) != std::string::npos; begin = end + 1)
      read_line(std::string_view(pending).substr(begin, end - begin), other);
    pending.erase(0, begin);
    searched = pending.size();
    if (pending.size() > kMostLineBytes) break;
  }
}

void Lane::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
}

bool Lane::ask(std::string_view method, const std::string& params, Answer answer) {
  if (questions_.size() >= kMostQuestions) return false;
  questions_.push_back({std::string(method), params, std::move(answer), Clock::now() + kAnswerPatience});
  next();
  return true;
}

void Lane::next() {
  if (under_way_ != 0 || writing_ || questions_.empty() || !socket_.is_open()) return;
  under_way_ = ++last_id_;
  line_ = fmt::format(R"({{"jsonrpc":"2.0","id":{},"method":"{}","params":{}}})"
                      "\n",
                      under_way_, questions_.front().method, questions_.front().params);
  writing_ = true;
  asio::async_write(socket_, asio::buffer(line_), [this](const boost::system::error_code& error, std::size_t) {
    writing_ = false;
    if (!error) next();  // else the reader sees the end, too
  });
}

void Lane::read_line(std::string_view line, const Other& other) {
  std::uint64_t id = 0;
  std::string_view member;
  if (!split_answer(line, id, member)) return other(line);
  if (id != under_way_ || questions_.empty()) return;
  const Question own = std::move(questions_.front());
  questions_.pop_front();
  under_way_ = 0;
  if (own.answer) own.answer(member);
  next();
}

void Lane::expire(std::string_view member) {
  const auto now = Clock::now();
  std::vector<Answer> late;
  for (Question& question : questions_) {
    if (question.answer && question.until < now) late.push_back(std::exchange(question.answer, nullptr));
  }
  // The first one stays where it is under way: prismd has it.
  const auto first = questions_.begin() + (under_way_ != 0 && !questions_.empty() ? 1 : 0);
  const auto kept = std::remove_if(first, questions_.end(), [](const Question& question) { return !question.answer; });
  questions_.erase(kept, questions_.end());
  for (const Answer& answer : late) answer(member);
}

void Lane::end(std::string_view member) {
  close();
  const auto questions = std::exchange(questions_, {});
  under_way_ = 0;
  for (const Question& question : questions) {
    if (question.answer) question.answer(member);
  }
}

}  // namespace prism::prismweb
