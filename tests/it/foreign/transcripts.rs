//! Transcripts as other programs write them, with the words and times that they contain.

use orator_formats::transcript::{Transcript, Word, WordSource};

/// File of another program, valid for the speaker `host`.
pub(crate) struct ForeignTranscript {
    pub(crate) name: &'static str,
    pub(crate) ending: &'static str,
    pub(crate) text: &'static str,
    /// `word@start-end` in seconds; `~` in the place of `@`: the times are estimates.
    words: &'static str,
}

pub(crate) const FORMATS: [ForeignTranscript; 20] = [
    // Words and a segment without times.
    ForeignTranscript {
        name: "whisperx",
        ending: "json",
        text: r#"{"segments": [
  {"start": 0.1, "end": 0.9, "text": " we meet", "words": [
    {"word": "we", "start": 0.1, "end": 0.3, "score": 0.9}, {"word": "meet", "start": 0.4, "end": 0.9, "score": 0.8}]},
  {"start": 1.0, "end": 2.0, "text": " 350 1998", "words": [{"word": "350"}, {"word": "1998"}]},
  {"text": " maybe", "words": []},
  {"start": 3.0, "end": 3.5, "text": " so", "words": [{"word": "so", "start": 3.0, "end": 3.5, "score": 0.7}]}],
 "word_segments": [{"word": "we", "start": 0.1, "end": 0.3}, {"word": "350"}], "language": "en"}
"#,
        words: "we@0.1-0.3 meet@0.4-0.9 350~1-1.5 1998~1.5-2 maybe~2-3 so@3-3.5",
    },
    // Literals of Python's json; the last word has no end.
    ForeignTranscript {
        name: "whisper-nan",
        ending: "json",
        text: r#"{"text": " so \"NaN\" well", "segments": [{"id": 0, "start": 0.5, "end": 1.25, "text": " so \"NaN\" well",
  "avg_logprob": NaN, "compression_ratio": -Infinity, "words": [
    {"word": " so", "start": 0.5, "end": 0.7, "probability": NaN}, {"word": " \"NaN\"", "start": NaN, "end": NaN},
    {"word": " well", "start": 1.0, "end": Infinity, "probability": 0.5}]}]}
"#,
        words: r#"so@0.5-0.7 "NaN"~0.7-1 well~1-1.25"#,
    },
    // Segments of one token each (`-ml 1`).
    ForeignTranscript {
        name: "whisper-cpp",
        ending: "json",
        text: r#"{"result": {"language": "en"}, "transcription": [
  {"timestamps": {"from": "00:00:00,200", "to": "00:00:00,450"}, "offsets": {"from": 200, "to": 450}, "text": " inter"},
  {"timestamps": {"from": "00:00:00,450", "to": "00:00:00,700"}, "offsets": {"from": 450, "to": 700}, "text": "esting"},
  {"timestamps": {"from": "00:00:00,700", "to": "00:00:00,700"}, "offsets": {"from": 700, "to": 700}, "text": ","},
  {"timestamps": {"from": "00:00:00,900", "to": "00:00:01,300"}, "offsets": {"from": 900, "to": 1300}, "text": " yes"}]}
"#,
        words: "interesting,@0.2-0.7 yes@0.9-1.3",
    },
    // Sentences with tokens (`-ojf`).
    ForeignTranscript {
        name: "whisper-cpp-full",
        ending: "json",
        text: r#"{"params": {"model": "base.en"}, "result": {"language": "en"}, "transcription": [
  {"offsets": {"from": 0, "to": 1400}, "text": " Rain falls", "tokens": [
    {"text": "[_BEG_]", "offsets": {"from": 0, "to": 0}, "id": 50363, "p": 0.9},
    {"text": " Rain", "offsets": {"from": 100, "to": 500}, "id": 10301, "p": 0.8},
    {"text": " fall", "offsets": {"from": 600, "to": 900}, "id": 2121, "p": 0.9},
    {"text": "s", "offsets": {"from": 900, "to": 1000}, "id": 82, "p": 0.7},
    {"text": "[_TT_70]", "offsets": {"from": 1400, "to": 1400}, "id": 50433, "p": 0.1}]},
  {"offsets": {"from": 2000, "to": 3000}, "text": " [soft music]"}]}
"#,
        words: "Rain@0.1-0.5 falls@0.6-1",
    },
    // The last chunk has no end.
    ForeignTranscript {
        name: "hugging-face",
        ending: "json",
        text: r#"{"text": " rain falls now", "chunks": [{"text": " rain", "timestamp": [0.0, 0.4]},
  {"text": " falls", "timestamp": [0.4, 0.8]}, {"text": " now", "timestamp": [1.5, null]}]}
"#,
        words: "rain@0-0.4 falls@0.4-0.8 now~1.5-1.5",
    },
    // One value for each utterance.
    ForeignTranscript {
        name: "vosk",
        ending: "json",
        text: r#"{
  "result" : [{"conf" : 0.9, "end" : 0.6, "start" : 0.2, "word" : "rain"}],
  "text" : "rain"
}
{"text" : ""}
{"result" : [{"conf" : 1.0, "end" : 2.5, "start" : 2.0, "word" : "falls"}], "text" : "falls"}
"#,
        words: "rain@0.2-0.6 falls@2-2.5",
    },
    // Milliseconds.
    ForeignTranscript {
        name: "assemblyai",
        ending: "json",
        text: r#"{"id": "7f-1", "status": "completed", "audio_url": "a.wav", "audio_duration": 3, "text": "Rain falls.", "words": [
  {"text": "Rain", "start": 120, "end": 480, "confidence": 0.9, "speaker": "A"},
  {"text": "falls.", "start": 2500, "end": 3000, "confidence": 0.8, "speaker": "A"}],
 "utterances": [{"text": "Rain falls.", "start": 120, "end": 3000, "speaker": "A"}]}
"#,
        words: "Rain@0.12-0.48 falls.@2.5-3",
    },
    // Milliseconds.
    ForeignTranscript {
        name: "assemblyai-sentences",
        ending: "json",
        text: r#"{"sentences": [{"text": "Rain falls.", "start": 120, "end": 3000, "confidence": 0.9, "words": [
  {"text": "Rain", "start": 120, "end": 480, "confidence": 0.9},
  {"text": "falls.", "start": 2500, "end": 3000, "confidence": 0.8}]}],
 "id": "7f-1", "confidence": 0.9, "audio_duration": 3}
"#,
        words: "Rain@0.12-0.48 falls.@2.5-3",
    },
    // Punctuation has no times.
    ForeignTranscript {
        name: "aws",
        ending: "json",
        text: r#"{"jobName": "talk", "status": "COMPLETED", "results": {"transcripts": [{"transcript": "Rain falls."}],
 "speaker_labels": {"speakers": 1, "segments": [{"start_time": "0.2", "end_time": "1.5", "speaker_label": "spk_0",
   "items": [{"start_time": "0.2", "end_time": "0.6", "speaker_label": "spk_0"}]}]},
 "items": [
  {"start_time": "0.2", "end_time": "0.6", "alternatives": [{"confidence": "0.9", "content": "Rain"}, {"content": "Reign"}],
   "type": "pronunciation"},
  {"start_time": "1.0", "end_time": "1.5", "alternatives": [{"confidence": "1.0", "content": "falls"}],
   "type": "pronunciation"},
  {"alternatives": [{"confidence": "0.0", "content": "."}], "type": "punctuation"}],
 "audio_segments": [{"id": 0, "transcript": "Rain falls.", "start_time": "0.2", "end_time": "1.5", "items": [0, 1, 2]}]}}
"#,
        words: "Rain@0.2-0.6 falls.@1-1.5",
    },
    // Only the first alternative is used.
    ForeignTranscript {
        name: "google-v1",
        ending: "json",
        text: r#"{"results": [{"alternatives": [{"transcript": "rain falls", "confidence": 0.9, "words": [
  {"startTime": "0s", "endTime": "0.400s", "word": "rain"}, {"startTime": "0.400s", "endTime": "1.200s", "word": "falls"}]},
  {"transcript": "reign falls", "words": [{"startTime": "0s", "endTime": "0.400s", "word": "reign"}]}]}]}
"#,
        words: "rain@0-0.4 falls@0.4-1.2",
    },
    // A time of zero is omitted.
    ForeignTranscript {
        name: "google-v2",
        ending: "json",
        text: r#"{"results": [{"alternatives": [{"transcript": "rain falls", "words": [
  {"endOffset": "0.400s", "word": "rain", "confidence": 0.9},
  {"startOffset": "0.400s", "endOffset": "1.200s", "word": "falls", "confidence": 0.8}]}],
 "resultEndOffset": "1.500s", "languageCode": "en-us"}]}
"#,
        words: "rain@0-0.4 falls@0.4-1.2",
    },
    // Durations as objects.
    ForeignTranscript {
        name: "google-client",
        ending: "json",
        text: r#"[{"alternatives": [{"transcript": "rain falls", "words": [
  {"start_time": {}, "end_time": {"nanos": 400000000}, "word": "rain"},
  {"start_time": {"nanos": 400000000}, "end_time": {"seconds": "1", "nanos": 200000000}, "word": "falls"}]}]}]
"#,
        words: "rain@0-0.4 falls@0.4-1.2",
    },
    // Offsets are positions in the text.
    ForeignTranscript {
        name: "gentle",
        ending: "json",
        text: r#"{"transcript": "rain Kilimanjaro falls", "words": [
  {"alignedWord": "rain", "case": "success", "start": 0.2, "end": 0.6, "startOffset": 0, "endOffset": 4,
   "phones": [{"duration": 0.1, "phone": "r_B"}], "word": "rain"},
  {"case": "not-found-in-audio", "startOffset": 5, "endOffset": 16, "word": "Kilimanjaro"},
  {"alignedWord": "<unk>", "case": "success", "start": 1.0, "end": 1.5, "startOffset": 17, "endOffset": 22,
   "phones": [{"duration": 0.5, "phone": "oov_S"}], "word": "falls"}]}
"#,
        words: "rain@0.2-0.6 Kilimanjaro~0.6-1 falls@1-1.5",
    },
    // Tiers of two speakers.
    ForeignTranscript {
        name: "mfa",
        ending: "json",
        text: r#"{"start": 0, "end": 2, "tiers": {
  "guest - words": {"type": "interval", "entries": [[0.1, 0.2, "no"]]},
  "guest - phones": {"type": "interval", "entries": [[0.1, 0.2, "N"]]},
  "host - words": {"type": "interval", "entries": [[0.0, 0.2, "sil"], [0.2, 0.6, "rain"], [0.6, 1.0, "<eps>"],
    [1.0, 1.5, "falls"], [1.5, 2, "spn"]]},
  "host - phones": {"type": "interval", "entries": [[0.2, 0.6, "R"]]}}}
"#,
        words: "rain@0.2-0.6 falls@1-1.5",
    },
    // Words and segments.
    ForeignTranscript {
        name: "openai-words",
        ending: "json",
        text: r#"{"task": "transcribe", "language": "english", "duration": 2.0, "text": "Rain falls.",
 "words": [{"word": "Rain", "start": 0.2, "end": 0.6}, {"word": "falls", "start": 1.0, "end": 1.5}],
 "segments": [{"id": 0, "seek": 0, "start": 0.0, "end": 2.0, "text": " Rain falls.", "tokens": [50364, 1]}]}
"#,
        words: "Rain@0.2-0.6 falls@1-1.5",
    },
    // Sentences share their time.
    ForeignTranscript {
        name: "openai-segments",
        ending: "json",
        text: r#"{"task": "transcribe", "language": "english", "duration": 9.0, "text": "Rain falls (applause)", "segments": [
  {"id": 0, "seek": 0, "start": 0.0, "end": 9.0, "text": " Rain falls", "tokens": [50364, 1]},
  {"id": 1, "seek": 0, "start": 9.0, "end": 9.5, "text": " (applause)", "tokens": [50364, 1]}]}
"#,
        words: "Rain~0-4 falls~4-9",
    },
    // Each cue repeats the line before.
    ForeignTranscript {
        name: "rolling",
        ending: "srt",
        text: "\
               1\n\
               00:00:01,000 --> 00:00:02,000\n\
               [Applause]\n\
               so we\n\
               \n\
               2\n\
               00:00:02,000 --> 00:00:02,010\n\
               so we\n\
               \x20\n\
               \n\
               3\n\
               00:00:03,000 --> 00:00:04,000\n\
               so we\n\
               go on\n\
               \n\
               4\n\
               00:00:04,000 --> 00:00:04,010\n\
               go on\n\
               \x20\n",
        words: "so~1-1.5 we~1.5-2 go~3-3.5 on~3.5-4",
    },
    // Words with times, and blank first lines.
    ForeignTranscript {
        name: "rolling",
        ending: "vtt",
        text: "\
               WEBVTT\n\
               Kind: captions\n\
               Language: en\n\
               \n\
               00:00:01.000 --> 00:00:02.000 align:start position:0%\n\
               \x20\n\
               so<00:00:01.500><c> we</c>\n\
               \n\
               00:00:02.000 --> 00:00:02.010 align:start position:0%\n\
               so we\n\
               \x20\n\
               \n\
               00:00:03.000 --> 00:00:04.000 align:start position:0%\n\
               so we\n\
               go<00:00:03.250><c> on</c>\n",
        words: "so@1-1.5 we@1.5-2 go@3-3.25 on@3.25-4",
    },
    // Marks of the Penn aligner.
    ForeignTranscript {
        name: "penn",
        ending: "TextGrid",
        text: r#"File type = "ooTextFile"
Object class = "TextGrid"

xmin = 0
xmax = 2
tiers? <exists>
size = 2
item []:
    item [1]:
        class = "IntervalTier"
        name = "phone"
        xmin = 0
        xmax = 2
        intervals: size = 1
        intervals [1]:
            xmin = 0
            xmax = 2
            text = "sp"
    item [2]:
        class = "IntervalTier"
        name = "word"
        xmin = 0
        xmax = 2
        intervals: size = 5
        intervals [1]:
            xmin = 0
            xmax = 0.2
            text = "sp"
        intervals [2]:
            xmin = 0.2
            xmax = 0.6
            text = "RAIN"
        intervals [3]:
            xmin = 0.6
            xmax = 1
            text = "{NS}"
        intervals [4]:
            xmin = 1
            xmax = 1.5
            text = "FALLS"
        intervals [5]:
            xmin = 1.5
            xmax = 2
            text = "{LG}"
"#,
        words: "RAIN@0.2-0.6 FALLS@1-1.5",
    },
    // Short format, two speakers, line breaks and quotes in labels.
    ForeignTranscript {
        name: "speakers",
        ending: "TextGrid",
        text: r#"File type = "ooTextFile"
Object class = "TextGrid"

0
2
<exists>
2
"IntervalTier"
"Guest - words"
0
2
1
0
2
"no"
"IntervalTier"
"Host - words"
0
2
3
0.2
0.6
"""rain""
"
0.6
1
""
1
1.5
"falls
"
"#,
        words: r#""rain"@0.2-0.6 falls@1-1.5"#,
    },
];

fn line(word: &Word) -> String {
    let mark = if word.source == WordSource::Given { '@' } else { '~' };
    format!("{}{mark}{}-{}", word.word, word.start_secs, word.end_secs)
}

#[test]
fn files_of_other_programs_have_their_words_and_times() {
    for ForeignTranscript { name, ending, text, words } in FORMATS {
        let lower = ending.to_ascii_lowercase();
        let transcript = Transcript::parse(text, &lower, ("a", "host")).unwrap();
        let found: Vec<String> = transcript.words.iter().map(line).collect();
        assert_eq!(found.join(" "), words, "{name}.{ending}");
        let estimated = transcript.words.iter().filter(|word| word.source == WordSource::Interpolated);
        assert!(estimated.clone().all(|word| word.confidence == Some(0.0)), "{name}.{ending}");
        let n_estimates = words.matches('~').count();
        assert_eq!(transcript.notes.len(), usize::from(n_estimates > 0), "{name}.{ending}: {:?}", transcript.notes);
    }
}

#[test]
fn milliseconds_are_recognised_by_the_format() {
    let text = |status: &str, end: &str| {
        format!(r#"{{"id": "1", "status": "{status}", "words": [{{"text": "so", "start": 1, "end": {end}}}]}}"#)
    };
    let end = |text: String| Transcript::parse(&text, "json", ("", "")).unwrap().words[0].end_secs;
    assert_eq!(end(text("completed", "500")), 0.5);
    // Large numbers of other formats are seconds.
    assert_eq!(end(text("done", "500")), 500.0);
    assert_eq!(end(r#"{"words": [{"text": "so", "start": 1000, "end": 2000}]}"#.to_owned()), 2000.0);
}

#[test]
fn a_transcript_without_words_of_the_speaker_says_so() {
    let error = |text: &str, ending: &str, speaker: &str| {
        format!("{:#}", Transcript::parse(text, ending, ("a", speaker)).unwrap_err())
    };
    for ForeignTranscript { text, ending, .. } in FORMATS.into_iter().filter(|f| ["mfa", "speakers"].contains(&f.name))
    {
        let message = error(text, &ending.to_ascii_lowercase(), "anna");
        assert!(message.to_lowercase().contains("(guest, host)") && message.contains("--speaker"), "{message}");
    }
    let penn = FORMATS.into_iter().find(|format| format.name == "penn").unwrap().text;
    assert!(error(&penn.replace("\"word\"", "\"syllables\""), "textgrid", "host").contains("contain phones"));
    assert!(error(r#"{"names": ["jawOpen"], "frames": [{"time": 0.1}]}"#, "json", "host").contains("expected `words`"));
    assert!(error(r#"{"words": [{"word": "so"}, {"word": "well"}]}"#, "json", "host").contains("word 1"));
    let plain = Transcript::parse(r#"{"text": "so [noise] well"}"#, "json", ("", "")).unwrap();
    assert_eq!((plain.text.as_str(), plain.words.len()), ("so well", 0));
}
