// A USB webcam (UVC 1.1, bulk transfers, JPEG and YUYV at 640x480 and 320x240) emulated in a process and plugged into
// the kernel's virtual USB host controller, module vhci_hcd, so that the kernel's own driver serves it. Its end unplugs
// it.
//
//   usb_camera [-p PORT] [-n NAME] [-E N] [-L N] [-b BRIGHT.jpg] PICTURE.jpg...
//
// The pictures are sent in turn; with -E every Nth one is empty. BRIGHT.jpg is what it sees at a fixed exposure of 0.1
// s or more. With -L a change of exposure shows N pictures late, N up to 7.

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>
#define W16(x) (x) & 255, ((x) >> 8) & 255
#define W32(x) (x) & 255, ((x) >> 8) & 255, ((x) >> 16) & 255, ((x) >> 24) & 255
#define PAYLOAD 16384
typedef uint8_t u8;
// The device as it describes itself, UVC 1.1 chapter 3.
// clang-format off
static const u8 devd[] = {18, 1, W16(0x200), 0xef, 2, 1, 64, W16(0x1209), W16(0x0001), W16(0x100), 1, 2, 3, 1};
#define FRAME(sub, idx, w, h, sz, defi) \
  38, 0x24, sub, idx, 0, W16(w), W16(h), W32(1000000), W32(100000000), W32(sz), W32(defi), \
  3, W32(333333), W32(666666), W32(1333333)
#define VS 15 + 11 + 38 * 2 + 6 + 27 + 38 * 2 + 6
static const u8 cfgd[] = {
  9, 2, W16(9 + 8 + 9 + 13 + 18 + 12 + 9 + 9 + VS + 7), 2, 1, 0, 0x80, 250,
  8, 11, 0, 2, 0x0e, 3, 0, 2,
  9, 4, 0, 0, 0, 0x0e, 1, 0, 2,
  13, 0x24, 1, W16(0x110), W16(13 + 18 + 12 + 9), W32(48000000), 1, 1,
  18, 0x24, 2, 1, W16(0x201), 0, 0, 0, 0, 0, 0, 0, 0, 3, 0x0a, 0, 0,   // camera: AE mode, exposure time
  12, 0x24, 5, 2, 1, 0, 0, 2, W16(0x201), 0, 0,                         // processing: brightness, gain
  9, 0x24, 3, 3, W16(0x101), 0, 2, 0,
  9, 4, 1, 0, 1, 0x0e, 2, 0, 0,
  15, 0x24, 1, 2, W16(VS), 0x81, 0, 3, 0, 0, 0, 1, 0, 0,
  11, 0x24, 6, 1, 2, 1, 1, 0, 0, 0, 0,
  FRAME(7, 1, 640, 480, 614400, 333333), FRAME(7, 2, 320, 240, 153600, 333333),
  6, 0x24, 13, 1, 1, 4,
  27, 0x24, 4, 2, 2, 'Y', 'U', 'Y', '2', 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71, 16, 1, 0, 0, 0, 0,
  FRAME(5, 1, 640, 480, 614400, 1333333), FRAME(5, 2, 320, 240, 153600, 666666),
  6, 0x24, 13, 1, 1, 4,
  7, 5, 0x81, 2, W16(512), 0};
// clang-format on
static int s, fmt = 1, frm = 1, ae = 8, expo = 250, bright = 128, gain = 10, stuck, empty_every;
static int late, before[8]; // exposures of the last pictures
static uint32_t interval = 333333;
static u8 probe[34];
static char *jpg[65];
static long jlen[65];
static int nj;
static char *bj;
static long bl;

static struct {
    uint32_t seq, len;
} q[64];

static int qn;
static u8 *cur;
static long clen, cpos;
static int fid, count;
static double next_t;
static u8 *yuyv;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + t.tv_nsec / 1e9;
}

static void rd(void *b, size_t n) {
    char *p = b;
    while (n) {
        ssize_t r = read(s, p, n);
        if (r <= 0) {
            if (r < 0 && errno == EINTR) continue;
            exit(0);
        }
        p += r;
        n -= r;
    }
}

static void wr(const void *b, size_t n) {
    const char *p = b;
    while (n) {
        ssize_t r = write(s, p, n);
        if (r <= 0) {
            if (r < 0 && errno == EINTR) continue;
            exit(0);
        }
        p += r;
        n -= r;
    }
}

static uint32_t be(uint32_t x) { return __builtin_bswap32(x); }

static void ret(uint32_t seq, int status, const void *d, uint32_t n, int in) {
    uint32_t h[12] = {be(3), be(seq), 0, 0, 0, be(status), be(n)};
    wr(h, 48);
    if (in && n) wr(d, n);
}

static void setprobe(void) {
    static const uint32_t sz[3] = {0, 614400, 153600};
    memset(probe, 0, sizeof probe);
    probe[0] = 1;
    probe[2] = fmt;
    probe[3] = frm;
    memcpy(probe + 4, &interval, 4);
    memcpy(probe + 18, &sz[frm], 4);
    uint32_t p = PAYLOAD;
    memcpy(probe + 22, &p, 4);
    uint32_t c = 48000000;
    memcpy(probe + 26, &c, 4);
}

static void newframe(void) {
    count++;
    cpos = 0;
    before[count & 7] = ae == 1 ? expo : 0;
    int exposed = before[(count - late) & 7];
    if (empty_every && count % empty_every == 0) {
        clen = 0;
        cur = (u8 *)"";
        return;
    }
    if (fmt == 1) {
        int b = exposed >= 1000 && bj;
        cur = (u8 *)(b ? bj : jpg[count % nj]);
        clen = b ? bl : jlen[count % nj];
        return;
    }
    int w = frm == 1 ? 640 : 320, h = frm == 1 ? 480 : 240;
    clen = w * h * 2;
    cur = yuyv;
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            u8 *p = yuyv + (y * w + x) * 2;
            p[0] = 16 + ((x + count * 4) & 127);
            p[1] = 128;
        }
}

static void pump(void) {
    while (qn) {
        if (!cur) {
            if (now() < next_t) return;
            double t = now();
            next_t = next_t + 1 < t ? t : next_t;
            next_t += interval / 1e7;
            newframe();
        }
        static u8 b[PAYLOAD];
        long n = clen - cpos, m = (q[0].len < PAYLOAD ? q[0].len : PAYLOAD) - 2;
        int eof = n <= m;
        if (n > m) n = m;
        b[0] = 2;
        b[1] = 0x80 | fid | (eof ? 2 : 0);
        memcpy(b + 2, cur + cpos, n);
        cpos += n;
        ret(q[0].seq, 0, b, n + 2, 1);
        memmove(q, q + 1, --qn * sizeof q[0]);
        if (eof) {
            cur = 0;
            fid ^= 1;
        }
    }
}

static int getctl(u8 req, int ent, int cs, int intf, u8 *o) { // returns length, -1 = stall
    if (intf == 1) {
        if (cs != 1 && cs != 2) return -1;
        if (req == 0x86) {
            o[0] = 3;
            return 1;
        }
        if (req == 0x85) {
            o[0] = 34;
            o[1] = 0;
            return 2;
        }
        setprobe();
        memcpy(o, probe, 34);
        return 34;
    }
    if (ent == 0) {
        o[0] = stuck;
        return 1;
    }
    int len, v[5]; // cur min max res def
    if (ent == 1 && cs == 2) {
        len = 1;
        int t[] = {ae, 0, 0, 9, 8};
        memcpy(v, t, sizeof t);
        if (req == 0x82 || req == 0x83) return -1;
    } else if (ent == 1 && cs == 4) {
        len = 4;
        int t[] = {expo, 3, 2047, 1, 250};
        memcpy(v, t, sizeof t);
    } else if (ent == 2 && cs == 2) {
        len = 2;
        int t[] = {bright, 0, 255, 1, 128};
        memcpy(v, t, sizeof t);
    } else if (ent == 2 && cs == 4) {
        len = 2;
        int t[] = {gain, 0, 100, 1, 10};
        memcpy(v, t, sizeof t);
    } else
        return -1;
    if (req == 0x86) {
        o[0] = 3;
        return 1;
    }
    if (req == 0x85) {
        o[0] = len;
        o[1] = 0;
        return 2;
    }
    int i = req == 0x81 ? 0 : req == 0x82 ? 1 : req == 0x83 ? 2 : req == 0x84 ? 3 : req == 0x87 ? 4 : -1;
    if (i < 0) return -1;
    for (int k = 0; k < len; k++)
        o[k] = v[i] >> (8 * k);
    return len;
}

static const char *names[4] = {"", "vmcam", "Emulated UVC Camera", "0001"};

static void ctrl(uint32_t seq, const u8 *u, uint32_t blen, int in, u8 *d) {
    int type = u[0], req = u[1], val = u[2] | u[3] << 8, idx = u[4] | u[5] << 8, len = u[6] | u[7] << 8;
    u8 o[256];
    int n = -1;
    const u8 *p = o;
    if ((type & 0x60) == 0x20) {
        if (in)
            n = getctl(req, idx >> 8, val >> 8, idx & 255, o);
        else {
            int x = 0;
            for (int k = 0; k < 4 && k < len; k++)
                x |= d[k] << (8 * k);
            n = 0;
            int ent = idx >> 8, cs = val >> 8;
            if ((idx & 255) == 1) {
                fmt = d[2] ? d[2] : 1;
                frm = d[3] ? d[3] : 1;
                memcpy(&interval, d + 4, 4);
                if (interval < 500000)
                    interval = 333333;
                else if (interval < 1000000)
                    interval = 666666;
                else
                    interval = 1333333;
                setprobe();
                if (cs == 2) {
                    cur = 0;
                    next_t = now();
                }
            } else if (ent == 1 && cs == 2)
                ae = x & 255;
            else if (ent == 1 && cs == 4) {
                if (ae == 1)
                    expo = x;
                else {
                    stuck = 2;
                    n = -1;
                }
            } // "wrong state" while in auto mode
            else if (ent == 2 && cs == 2)
                bright = x & 0xffff;
            else if (ent == 2 && cs == 4)
                gain = x & 0xffff;
            else
                n = -1;
        }
    } else if (req == 6) {
        if (val >> 8 == 1)
            p = devd, n = sizeof devd;
        else if (val >> 8 == 2)
            p = cfgd, n = sizeof cfgd;
        else if (val >> 8 == 3 && (val & 255) < 4) {
            int i = val & 255;
            if (!i) {
                o[0] = 4;
                o[1] = 3;
                o[2] = 9;
                o[3] = 4;
                n = 4;
            } else {
                n = 2;
                for (const char *c = names[i]; *c; c++) {
                    o[n++] = *c;
                    o[n++] = 0;
                }
                o[0] = n;
                o[1] = 3;
            }
        }
    } else if (req == 0) {
        o[0] = o[1] = 0;
        n = 2;
    } else if (req == 8 || req == 10) {
        o[0] = req == 8;
        n = 1;
    } else if (req == 1) {
        cur = 0;
        n = 0;
    } else if (req == 9 || req == 11 || req == 3)
        n = 0;
    if (n < 0) {
        ret(seq, -32, 0, 0, in);
        return;
    }
    if (in) {
        if (n > len) n = len;
        if (n > (int)blen) n = blen;
        ret(seq, 0, p, n, 1);
    } else
        ret(seq, 0, 0, blen, 0);
}

int main(int c, char **v) {
    int port = 0, o;
    yuyv = malloc(614400);
    while ((o = getopt(c, v, "p:n:E:L:b:")) != -1) {
        if (o == 'p')
            port = atoi(optarg);
        else if (o == 'n')
            names[2] = optarg;
        else if (o == 'E')
            empty_every = atoi(optarg);
        else if (o == 'L')
            late = atoi(optarg) & 7;
        else if (o == 'b') {
            FILE *g = fopen(optarg, "rb");
            if (!g) return perror(optarg), 1;
            bj = malloc(1 << 20);
            bl = fread(bj, 1, 1 << 20, g);
            fclose(g);
        } else
            return 2;
    }
    for (; optind < c && nj < 64; optind++) {
        FILE *g = fopen(v[optind], "rb");
        if (!g) return perror(v[optind]), 1;
        jpg[nj] = malloc(1 << 20);
        jlen[nj] = fread(jpg[nj], 1, 1 << 20, g);
        nj++;
        fclose(g);
    }
    if (!nj) return fprintf(stderr, "no jpg\n"), 2;
    int sp[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, sp)) return perror("socketpair"), 1;
    s = sp[0];
    int a = open("/sys/devices/platform/vhci_hcd.0/attach", O_WRONLY);
    if (a < 0) return perror("attach (vhci_hcd loaded?)"), 1;
    char b[64];
    int n = snprintf(b, sizeof b, "%d %d %d 3", port, sp[1], 0x10000 | (port + 1));
    if (write(a, b, n) != n) return perror("attach"), 1;
    close(a);
    close(sp[1]);
    setprobe();
    for (;;) {
        struct pollfd pf = {s, POLLIN, 0};
        int to = -1;
        if (qn) {
            double t = cur ? 0 : next_t - now();
            to = t <= 0 ? 0 : (int)(t * 1000) + 1;
        }
        if (poll(&pf, 1, to) > 0) {
            uint32_t h[12];
            rd(h, 48);
            uint32_t cmd = be(h[0]), seq = be(h[1]), in = be(h[3]), ep = be(h[4]);
            if (cmd == 2) {
                uint32_t t = be(h[5]);
                int st = 0;
                for (int i = 0; i < qn; i++)
                    if (q[i].seq == t) {
                        memmove(q + i, q + i + 1, (--qn - i) * sizeof q[0]);
                        st = -104;
                        break;
                    }
                uint32_t r[12] = {be(4), be(seq), 0, 0, 0, be(st)};
                wr(r, 48);
                continue;
            }
            uint32_t len = be(h[6]);
            static u8 d[65536];
            if (!in && len) rd(d, len > sizeof d ? sizeof d : len);
            if (ep == 0)
                ctrl(seq, (u8 *)&h[10], len, in, d);
            else if (ep == 1 && in && qn < 64) {
                q[qn].seq = seq;
                q[qn++].len = len;
            } else
                ret(seq, -32, 0, 0, in);
        }
        pump();
    }
}
