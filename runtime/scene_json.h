// The text of a scene file as a tree whose every value knows the line it stands on, so that an error about it can say
// where. Options of the command line become the same trees, and are read by the same code (scene_read.cpp).
#pragma once

#include "format/result.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace trimray {

struct SceneNode {
    enum class Kind {
        Null,
        Boolean,
        Number,
        String,
        Array,
        Object,
        Words, // of the command line: a number, several with commas between them, or a word, whatever is expected
    };
    Kind kind = Kind::Null;
    bool boolean = false;
    uint32_t line = 0;            // where the value ends, or an array or object begins; counted from 1
    uint32_t key_line = 0;        // where the key that names it ends
    double number = 0;            // finite
    std::string text;             // String, Words
    std::vector<SceneNode> items; // Array; Object: the values of `keys`
    std::vector<std::string> keys;
    std::string option; // the option of the command line that says it; empty: a file does

    const SceneNode* find(std::string_view key) const;
};

// What a scene file may hold. A list of a hundred thousand faces is within them
constexpr size_t kMostSceneBytes = size_t{8} << 20, kMostSceneValues = size_t{1} << 18, kMostSceneKeys = 64;
constexpr size_t kMostSceneDepth = 16;

/// The tree of a JSON text (RFC 8259: UTF-8, numbers within double's range, no key twice in an object). `name` is the
/// file's, for errors, whose `where` is "name:line". Fails: InvalidScene.
Result<SceneNode> parse_scene_json(std::string_view text, const std::string& name);

/// A node as the command line's `option` has it.
SceneNode words_node(const std::string& option, std::string text);

/// Sets what lies at `path` ("effects.edges.lines") below an object, and makes the objects on the way.
void set_node(SceneNode& root, std::string_view path, SceneNode value);

/// "key=value,key=value" as an object; a value goes on to the next key, so that it may have commas.
/// Fails: Usage, at `option`.
Result<SceneNode> pairs_node(const std::string& option, const std::string& text);

} // namespace trimray
