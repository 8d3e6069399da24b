"""Films read back with ffprobe and ffmpeg."""
import json
import subprocess


def probe(film):
    """Size, rate and number of decoded frames, and the errors of ffprobe."""
    done = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0", "-show_entries",
                           "stream=codec_name,width,height,r_frame_rate,nb_read_frames", "-of", "json", str(film)],
                          capture_output=True, text=True, timeout=60)
    streams = json.loads(done.stdout or "{}").get("streams", [])
    found = streams[0] if streams else {"nb_read_frames": 0}
    found["nb_read_frames"] = int(found.get("nb_read_frames", 0))
    return found, done.stderr


def frame(film, index):
    """One frame as RGB bytes, rows from the top."""
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(film), "-vf", f"select=eq(n\\,{index})", "-frames:v", "1",
                           "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, timeout=60, check=True)
    return done.stdout


def mean_difference(a, b):
    assert len(a) == len(b)
    return sum(abs(x - y) for x, y in zip(a, b)) / len(a)
