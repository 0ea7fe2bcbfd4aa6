// Tokens that others sign: whatever a client sends, nothing but what the key signed lets it in. Bytes of a file of
// keys.
#include "live/server/web_token.h"

#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/rsa.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    fuzz::FuzzInput input(data, size);
    const auto what = input.u8();
    const auto rest = input.rest();
    const std::string text(rest.begin(), rest.end());
    // A key whose private half nobody has.
    static const live::WebTokenKeys keys = {{live::WebTokenAlgorithm::es256, "a", {EVP_EC_gen("P-256"), EVP_PKEY_free}},
                                            {live::WebTokenAlgorithm::rs256, "", {EVP_RSA_gen(2048), EVP_PKEY_free}}};
    if (what % 8 == 0) {
        static const auto path =
            (std::filesystem::temp_directory_path() / ("htvm-fuzz-keys-" + std::to_string(::getpid()))).string();
        std::ofstream(path) << text;
        if (const auto read = live::read_web_token_keys(path)) {
            fuzz::require(!read->empty() && read->size() <= live::most_web_token_keys,
                          "there are as many keys as may be");
            for (const auto& key : *read) fuzz::require(key.key != nullptr, "each key is there");
        }
        std::remove(path.c_str());
        return 0;
    }
    const auto check = live::check_web_token(keys, {}, text, {"watch", "anna", ""},
                                             std::chrono::system_clock::time_point(std::chrono::seconds(1)));
    fuzz::require(check == live::WebTokenCheck::malformed || check == live::WebTokenCheck::forged,
                  "nobody makes a token without the key");
    fuzz::require(check == live::WebTokenCheck::malformed || live::looks_like_web_token(text),
                  "what has not the form of a token is none");
    return 0;
}
