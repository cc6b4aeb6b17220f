"""Forced alignment of an English text with its audio by pocketsphinx. Standard input: the number of words, then one
line per word: the word, and the range of seconds in which it may be spoken ("-": unknown); then the audio, 16 kHz,
16-bit mono. Standard output: an empty line once the modules are loaded, then one line per word, in order: start, end
and confidence, or "-" if the word does not fit.

The audio is processed in chunks of half a minute, so that memory does not grow with its length. In a chunk, the next
words follow each other or are interrupted, at a cost, by any sequence of phones, after which any of the words may
follow. The end of a chunk is aligned again together with the next chunk."""
import array
import itertools
import math
import os
import re
import sys
import unicodedata

import pocketsphinx

RATE, BYTES, FRAMES = 16_000, 32_000, 100
# Length of a chunk, of its end that is aligned again, and of its end in which words may be left to the next chunk,
# seconds.
CHUNK_SECS, OVERLAP_SECS, TAIL_SECS = 30, 2, 10
# Words per second of the fastest and of typical speech; maximum number of words considered in one chunk.
MAX_RATE, TYPICAL_RATE, MAX_WORDS = 6, 2.5, 300
# Error of the given times, seconds.
HINT_SECS = 5
# Probabilities that penalise a sequence of phones instead of words: each phone, its start, its end.
PHONE, BEGIN, END = 1e-14, 1e-15, 1e-15
# Words and seconds of a run that is accepted although it skips more words than fit into the time before it.
RUN_WORDS, RUN_SECS = 4, 1.0
# Minimum number of words accepted between two sequences of phones.
MIN_ISOLATED_WORDS = 3
# Cost per frame, in nats, of a word that fits perfectly, and of one that fits no better than arbitrary phones.
GOOD_COST, BAD_COST = 3.0, 8.0
# Fillers between words; the noise entries of the model would replace words.
FILLERS = b"<s> SIL\n</s> SIL\n<sil> SIL\n"
PHONES = """\
AA AE AH AO AW AY B CH D DH EH ER EY F G HH IH IY JH K L M N NG OW OY P R S SH T TH UH UW V W Y Z ZH""".split()
GROUPS = {
    "tion": "SH AH N", "tch": "CH", "igh": "AY", "eau": "OW", "sch": "SH", "ch": "CH", "sh": "SH", "th": "TH",
    "ph": "F", "gh": "G", "ck": "K", "ng": "NG", "qu": "K W", "wh": "W", "wr": "R", "kn": "N", "ee": "IY", "ea": "IY",
    "oo": "UW", "ou": "AW", "ow": "OW", "oi": "OY", "oy": "OY", "ai": "EY", "ay": "EY", "ei": "EY", "ey": "IY",
    "au": "AO", "aw": "AO", "ie": "IY", "er": "ER", "ir": "ER", "ur": "ER", "ar": "AA R", "or": "AO R", "a": "AE",
    "b": "B", "c": "K", "d": "D", "e": "EH", "f": "F", "g": "G", "h": "HH", "i": "IH", "j": "JH", "k": "K", "l": "L",
    "m": "M", "n": "N", "o": "OW", "p": "P", "q": "K", "r": "R", "s": "S", "t": "T", "u": "AH", "v": "V", "w": "W",
    "x": "K S", "y": "IY", "z": "Z",
}
ONES = """zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen
seventeen eighteen nineteen""".split()
TENS = "twenty thirty forty fifty sixty seventy eighty ninety".split()
ORDINALS = {"one": "first", "two": "second", "three": "third", "five": "fifth", "eight": "eighth", "nine": "ninth",
            "twelve": "twelfth"}
SIGNS = {"%": "percent", "&": "and", "$": "dollars", "+": "plus", "@": "at"}


def number(n, link=()):
    """The words of an integer below a billion; `link` follows the hundreds."""
    if n < 20:
        return [ONES[n]]
    if n < 100:
        return [TENS[n // 10 - 2]] + ([ONES[n % 10]] if n % 10 else [])
    for size, name in ((1_000_000, "million"), (1000, "thousand"), (100, "hundred")):
        if n >= size:
            rest = n % size
            tail = [*(link if rest < 100 else ()), *number(rest, link)] if rest else []
            return number(n // size, link) + [name] + tail


def readings(digits, ending):
    """Readings of a number with an ending such as "th", each a list of words."""
    n = int(digits)
    if len(digits) > 9 or (len(digits) > 1 and digits[0] == "0"):
        return [[ONES[int(digit)] for digit in digits]]
    ways = [number(n), number(n, ["and"])]
    if 1000 < n < 10_000 and n // 100 % 10:
        high, low = number(n // 100), n % 100
        ways.append(high + ["hundred"] + (number(low) if low else []))
        if low:
            ways.append(high + (["oh"] if low < 10 else []) + number(low))
    if ending not in ("", "s"):
        for way in ways:
            last = way[-1]
            way[-1] = ORDINALS.get(last) or (last[:-1] + "ieth" if last.endswith("y") else last + "th")
    return ways


class Pronunciations:
    """The dictionary of the model, with guesses for words that it lacks."""

    def __init__(self, decoder):
        self.lookup = decoder.lookup_word

    def listed(self, word):
        found = [self.lookup(word)] + [self.lookup(f"{word}({n})") for n in range(2, 6)]
        return [phones for phones in found if phones]

    def of(self, word):
        """Possible phone sequences of a word of the text; empty if its pronunciation is unknown."""
        word = word.lower().replace("\u2019", "'")
        word = "".join(letter for letter in unicodedata.normalize("NFKD", word) if not unicodedata.combining(letter))
        ways = []
        if not re.search(r"\d", word):
            ways = self.listed(word) or self.listed(re.sub(r"^[^a-z']+|[^a-z']+$", "", word))
        if ways:
            return ways
        if re.search(r"[^\W\da-z_]", word):
            return []
        word = re.sub(r"(?<=\d),(?=\d{3})", "", word)
        word = re.sub(r"(?<=\d)\.(?=\d)", " point ", word)
        word = re.sub(r"\$(\d[\d ]*)", r"\1 dollars", word)
        if not re.search(r"[a-z0-9]", word):
            return []
        parts = re.findall(r"(\d+)(st|nd|rd|th|s)?(?![a-z])|([a-z']*[a-z][a-z']*|\d+|[%&$+@])", word)
        choices = [self.counted(digits, ending) if digits else self.part(part) for digits, ending, part in parts]
        whole = [" ".join(rows) for rows in itertools.islice(itertools.product(*choices), 8)]
        return list(dict.fromkeys(whole))

    def counted(self, digits, ending):
        rows = [" ".join(filter(None, map(self.lookup, words))) for words in readings(digits, ending)]
        return [row + " Z" for row in rows] if ending == "s" else rows

    def part(self, part):
        part = SIGNS.get(part, part)
        if part.isdigit():
            return self.counted(part, "")
        listed = self.listed(part) or self.listed(part.replace("'", ""))
        return listed or [self.guess(re.sub(r"[^a-z]", "", part))]

    def guess(self, letters):
        """Phones of a word that is not in the dictionary: as a compound of two words, as an abbreviation spelt out if
        it has no vowel, or from groups of letters."""
        for at in range(len(letters) - 3, 2, -1):
            both = self.lookup(letters[:at]), self.lookup(letters[at:])
            if all(both):
                return " ".join(both)
        spelt = [self.lookup(f"{letter}.") or self.lookup(letter) for letter in letters]
        if not re.search(r"[aeiouy]", letters) and all(spelt):
            return " ".join(spelt)
        letters, phones, at = re.sub(r"(.)\1", r"\1", letters), [], 0
        if len(letters) > 3 and letters.endswith("e"):
            letters = letters[:-1]
        while at < len(letters):
            size = next(size for size in (4, 3, 2, 1) if letters[at:at + size] in GROUPS)
            phones.append(GROUPS[letters[at:at + size]])
            at += size
        return " ".join(phones)


class Aligner:
    def __init__(self, words, hints):
        # The library reads the list of fillers only from a file, so one is created in memory.
        fillers = os.memfd_create("fillers")
        os.write(fillers, FILLERS)
        self.decoder = pocketsphinx.Decoder(
            samprate=RATE, loglevel="FATAL", lm=None, bestpath=False, fdict=f"/proc/self/fd/{fillers}", beam=1e-80,
            pbeam=1e-80, wbeam=1e-60)
        os.close(fillers)
        pronunciations = Pronunciations(self.decoder)
        known = {word: pronunciations.of(word) for word in dict.fromkeys(words)}
        self.ways = [known[word] for word in words]
        # Names unique to every word, from which its index in the text is known.
        for number, ways in enumerate(self.ways):
            for way, phones in enumerate(ways):
                self.decoder.add_word(f"{number}_{way}", phones, False)
        for phone in PHONES:
            self.decoder.add_word(f"+{phone}", phone, phone == PHONES[-1])
        self.hints = hints
        self.found = [None] * len(words)

    def window(self, first, at, secs, lost_secs):
        """Indices of the words that may be spoken in `secs` seconds of audio from second `at` on."""
        numbers, max_words = [], min(MAX_RATE * secs + TYPICAL_RATE * lost_secs, MAX_WORDS)
        for number in range(first, len(self.ways)):
            start, end = self.hints[number]
            if len(numbers) >= max_words or (start is not None and start > at + secs + HINT_SECS):
                break
            if self.ways[number] and (end is None or end > at - HINT_SECS):
                numbers.append(number)
        return numbers

    def decode(self, numbers, sound, at):
        """Index, start, end and cost per frame of the words found in the audio, in text order."""
        n = len(numbers)
        phones, after, end = n + 1, n + 2, n + 3
        moves = [(k, k + 1, 1.0, f"{number}_{way}")
                 for k, number in enumerate(numbers) for way in range(len(self.ways[number]))]
        for k in range(n + 1):
            moves += [(k, phones, BEGIN), (after, k, END), (k, end, 1.0)]
        moves += [(phones, after, PHONE, f"+{phone}") for phone in PHONES] + [(after, phones, 1.0), (after, end, 1.0)]
        self.decoder.add_fsg("chunk", self.decoder.create_fsg("chunk", 0, end, moves))
        self.decoder.activate_search("chunk")
        self.decoder.start_utt()
        self.decoder.process_raw(sound, full_utt=True)
        self.decoder.end_utt()
        # Runs of words, with the number of filler phones before each.
        spans, n_rows = [], 0
        for part in self.decoder.seg() or []:
            name, _, way = part.word.partition("_")
            n_rows += name.startswith("+")
            if way:
                frames = part.end_frame + 1 - part.start_frame
                # Likelihoods are powers of 1.0001 whose exponents are stored in units of 1024.
                cost = -1024 * math.log(max(part.ascore, 1e-300)) / frames
                start = at + part.start_frame / FRAMES
                spans.append((n_rows, (int(name), start, start + frames / FRAMES, cost)))
        runs = [(rows, [span for _, span in run]) for rows, run in itertools.groupby(spans, lambda pair: pair[0])]
        accepted = [run for rows, run in runs if len(run) >= MIN_ISOLATED_WORDS or rows in (0, n_rows)]
        return longest_ordered([span for run in accepted for span in run])

    def run(self, read):
        """Aligns all words with the audio that `read` returns, called with a number of bytes."""
        sound, at, first, is_end, lost_secs = b"", 0.0, 0, False, 0.0
        while not is_end and first < len(self.ways):
            more = read(CHUNK_SECS * BYTES - len(sound))
            is_end = len(sound) + len(more) < CHUNK_SECS * BYTES
            sound += more
            chunk = sound[:len(sound) // 2 * 2] if is_end else sound[:pause(sound)]
            secs = len(chunk) / BYTES
            numbers = self.window(first, at, secs, lost_secs)
            spans = self.decode(numbers, chunk, at) if numbers and secs >= 0.1 else []
            spans = plausible(spans, first, at)
            until = at + secs
            if not is_end:
                spans = [span for span in spans if span[2] <= until - OVERLAP_SECS]
            for number, start, end, cost in spans:
                fit = (BAD_COST - cost) / (BAD_COST - GOOD_COST)
                self.found[number] = (start, end, min(max(fit, 0.01), 1.0))
            first = spans[-1][0] + 1 if spans else first
            end = max(spans[-1][2], until - TAIL_SECS) if spans else until - OVERLAP_SECS
            lost_secs = 0.0 if spans else lost_secs + end - at
            step = max(bytes_of(end - at), 0)
            sound, at = sound[step:], at + step / BYTES


def longest_ordered(spans):
    """The spans in text order with the longest total duration."""
    best = []
    for n, (number, start, end, _) in enumerate(spans):
        before = max((m for m in range(n) if spans[m][0] < number), key=lambda m: best[m][0], default=None)
        best.append(((best[before][0] if before is not None else 0.0) + end - start, before))
    at = max(range(len(best)), key=lambda n: best[n][0], default=None)
    accepted = []
    while at is not None:
        accepted.append(spans[at])
        at = best[at][1]
    return accepted[::-1]


def plausible(spans, first, at):
    """The spans without short runs that skip more words than can be spoken in the time before them."""
    accepted, last, next_number = [], at, first
    for _, run in itertools.groupby(enumerate(spans), lambda pair: pair[1][0] - pair[0]):
        run = [span for _, span in run]
        skipped = run[0][0] - next_number
        if skipped > MAX_RATE * (run[0][1] - last) + 2 and (len(run) < RUN_WORDS or run[-1][2] - run[0][1] < RUN_SECS):
            continue
        accepted += run
        last, next_number = run[-1][2], run[-1][0] + 1
    return accepted


def pause(sound):
    """Number of bytes before the quietest moment of the last third."""
    samples, step = array.array("h", sound), RATE // 10
    starts = range(2 * len(samples) // 3, len(samples) - step, step // 2)
    return 2 * (min(starts, key=lambda at: sum(map(abs, samples[at:at + step]))) + step // 2)


def bytes_of(secs):
    return 2 * round(secs * RATE)


def main():
    print(flush=True)
    source = sys.stdin.buffer
    rows = [source.readline().decode().rstrip("\n").split("\t") for _ in range(int(source.readline()))]
    hints = [tuple(None if secs == "-" else float(secs) for secs in row[1:]) for row in rows]
    aligner = Aligner([row[0] for row in rows], hints)
    aligner.run(source.read)
    # The remaining audio is read, so that its writer does not block.
    while source.read(1 << 20):
        pass
    for found in aligner.found:
        print("-" if found is None else "{:.2f}\t{:.2f}\t{:.2f}".format(*found))


if __name__ == "__main__":
    main()
