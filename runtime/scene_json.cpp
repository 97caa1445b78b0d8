#include "runtime/scene_json.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <optional>
#include <utility>

namespace trimray {
namespace {

/// Characters of a text; the parser's own position is lost to its handler, so each character that is taken counts the
/// lines before it.
class CountingIterator {
public:
    using iterator_category = std::input_iterator_tag;
    using value_type = char;
    using difference_type = std::ptrdiff_t;
    using pointer = const char*;
    using reference = const char&;

    CountingIterator(const char* at, uint32_t* line) : at_(at), line_(line) {}
    reference operator*() const { return *at_; }
    CountingIterator& operator++()
    {
        // the parser takes the character behind a number before it tells of it: a line ends where its successor begins
        if (ended_)
            ++*line_;
        ended_ = *at_++ == '\n';
        return *this;
    }
    CountingIterator operator++(int)
    {
        CountingIterator before = *this;
        ++*this;
        return before;
    }
    bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
    bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

private:
    const char* at_;
    uint32_t* line_;
    bool ended_ = false; // the last character that was taken ended a line
};

/// Builds the tree from the parser's events.
class TreeBuilder : public nlohmann::json_sax<nlohmann::json> {
public:
    TreeBuilder(const std::string& name, const uint32_t& line) : name_(name), line_(line) {}

    bool null() override { return add({}); }
    bool boolean(bool value) override
    {
        SceneNode node;
        node.kind = SceneNode::Kind::Boolean;
        node.boolean = value;
        return add(std::move(node));
    }
    bool number_integer(number_integer_t value) override { return add_number(static_cast<double>(value)); }
    bool number_unsigned(number_unsigned_t value) override { return add_number(static_cast<double>(value)); }
    bool number_float(number_float_t value, const string_t&) override { return add_number(value); }
    bool string(string_t& value) override
    {
        SceneNode node;
        node.kind = SceneNode::Kind::String;
        node.text = std::move(value);
        return add(std::move(node));
    }
    bool binary(binary_t&) override { return refuse("binary values are no JSON"); }
    bool start_object(std::size_t) override { return open(SceneNode::Kind::Object); }
    bool start_array(std::size_t) override { return open(SceneNode::Kind::Array); }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }
    bool key(string_t& value) override
    {
        std::vector<std::string>& keys = open_.back().keys;
        if (std::find(keys.begin(), keys.end(), value) != keys.end())
            return refuse(fmt::format("the key '{}' is there twice", value));
        if (keys.size() == kMostSceneKeys)
            return refuse(fmt::format("an object of more than {} keys", kMostSceneKeys));
        keys.push_back(std::move(value));
        key_line_ = line_;
        return true;
    }
    bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& fault) override
    {
        // "[json.exception...] parse error at line 3, column 5: syntax error while parsing ...": the line is told apart
        const std::string_view what = fault.what();
        const size_t column = what.find("column "), told = what.find(": ", column == what.npos ? 0 : column);
        return refuse(std::string(told == what.npos ? what : what.substr(told + 2)));
    }

    const std::optional<Error>& error() const { return error_; }
    SceneNode take() { return std::move(root_); }

private:
    bool refuse(std::string detail)
    {
        error_ = Error{ErrorCode::InvalidScene, fmt::format("{}:{}", name_, line_), std::move(detail)};
        return false;
    }
    bool admit(SceneNode& node)
    {
        if (++values_ > kMostSceneValues)
            return refuse(fmt::format("more than {} values", kMostSceneValues));
        node.line = line_;
        node.key_line = open_.empty() || open_.back().kind != SceneNode::Kind::Object ? line_ : key_line_;
        return true;
    }
    void put(SceneNode node)
    {
        if (open_.empty())
            root_ = std::move(node);
        else
            open_.back().items.push_back(std::move(node));
    }
    bool add(SceneNode node)
    {
        if (!admit(node))
            return false;
        put(std::move(node));
        return true;
    }
    bool add_number(double value)
    {
        SceneNode node;
        node.kind = SceneNode::Kind::Number;
        node.number = value;
        return add(std::move(node));
    }
    bool open(SceneNode::Kind kind)
    {
        SceneNode node;
        node.kind = kind;
        if (open_.size() == kMostSceneDepth)
            return refuse(fmt::format("lists and objects in each other, more than {} deep", kMostSceneDepth));
        if (!admit(node))
            return false;
        open_.push_back(std::move(node));
        return true;
    }
    bool close()
    {
        SceneNode node = std::move(open_.back());
        open_.pop_back();
        put(std::move(node));
        return true;
    }

    const std::string& name_;
    const uint32_t& line_;
    uint32_t key_line_ = 1;
    size_t values_ = 0;
    std::vector<SceneNode> open_; // the values that have begun and not ended, outermost first
    SceneNode root_;
    std::optional<Error> error_;
};

bool is_key(std::string_view text)
{
    return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
        return std::islower(c) != 0 || std::isdigit(c) != 0 || c == '_';
    });
}

} // namespace

const SceneNode* SceneNode::find(std::string_view key) const
{
    for (size_t i = 0; i < keys.size(); ++i)
        if (keys[i] == key)
            return &items[i];
    return nullptr;
}

Result<SceneNode> parse_scene_json(std::string_view text, const std::string& name)
{
    if (text.size() > kMostSceneBytes)
        return Error{ErrorCode::InvalidScene, name,
                     fmt::format("{} bytes; a scene file has at most {}", text.size(), kMostSceneBytes)};
    uint32_t line = 1;
    TreeBuilder tree(name, line);
    const CountingIterator first(text.data(), &line), last(text.data() + text.size(), &line);
    if (!nlohmann::json::sax_parse(first, last, &tree))
        return *tree.error();
    return tree.take();
}

SceneNode words_node(const std::string& option, std::string text)
{
    SceneNode node;
    node.kind = SceneNode::Kind::Words;
    node.text = std::move(text);
    node.option = option;
    return node;
}

void set_node(SceneNode& root, std::string_view path, SceneNode value)
{
    root.kind = SceneNode::Kind::Object;
    const size_t dot = path.find('.');
    const std::string_view key = path.substr(0, dot);
    size_t place = static_cast<size_t>(std::find(root.keys.begin(), root.keys.end(), key) - root.keys.begin());
    if (place == root.keys.size()) {
        root.keys.emplace_back(key);
        root.items.emplace_back();
        root.items.back().option = value.option;
    }
    if (dot == path.npos)
        root.items[place] = std::move(value);
    else
        set_node(root.items[place], path.substr(dot + 1), std::move(value));
}

Result<SceneNode> pairs_node(const std::string& option, const std::string& text)
{
    SceneNode object;
    object.kind = SceneNode::Kind::Object;
    object.option = option;
    for (size_t begin = 0; begin <= text.size();) {
        const size_t end = std::min(text.find(',', begin), text.size());
        const std::string piece = text.substr(begin, end - begin);
        begin = end + 1;
        const size_t equals = piece.find('=');
        const std::string key = piece.substr(0, std::min(equals, piece.size()));
        if (equals != piece.npos && is_key(key)) {
            if (object.find(key) != nullptr)
                return Error{ErrorCode::Usage, option, fmt::format("the key '{}' is there twice", key)};
            set_node(object, key, words_node(fmt::format("{} {}", option, key), piece.substr(equals + 1)));
        } else if (object.items.empty()) {
            return Error{ErrorCode::Usage, option, fmt::format("expected key=value,..., found '{}'", text)};
        } else {
            object.items.back().text += "," + piece;
        }
    }
    return object;
}

} // namespace trimray
