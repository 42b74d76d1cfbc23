/* Threads that share pieces of work: the one that asks for it, and helpers that the host starts. */

#ifndef SERPENTAIL_CREW_H
#define SERPENTAIL_CREW_H

#include <pthread.h>

typedef void (*Piece)(void *data, int piece);

typedef struct {
    pthread_mutex_t lock;
    pthread_cond_t begun, done; /* work for helpers, or none ever again; all pieces are done */
    int helpers;                /* 0: the lock is not used */
    int pieces, next, left;     /* how many, the next one to take, how many are not done */
    int dismissed;
    Piece piece;
    void *data;
} Crew;

int crew_begin(Crew *crew); /* 1 where it fails; without helpers */
void crew_end(Crew *crew);  /* no helper is inside any more */
void crew_help(Crew *crew); /* of a helper: work until dismissed */
void crew_dismiss(Crew *crew);
/* piece(data, k) for all k < pieces, each once and in any thread; returns when all are done. */
void crew_share(Crew *crew, int pieces, Piece piece, void *data);

#endif
